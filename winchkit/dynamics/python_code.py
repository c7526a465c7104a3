"""A profile as one Python module: the same step as the C header, with ``math`` only."""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence
from keyword import iskeyword

from winchkit.dynamics.c_code import identifier
from winchkit.dynamics.expression import over, power, root, sign, statements
from winchkit.dynamics.step import BEFORE, inputs_of, outputs_of, step_of
from winchkit.effects.term import Term
from winchkit.schema.profiles.winch import WinchProfile

_FUNCTIONS = (
    "atan2",
    "cos",
    "exp",
    "expm1",
    "floor",
    "hypot",
    "inf",
    "log",
    "log1p",
    "nan",
    "sin",
    "tanh",
)
_HELPERS = {one.__name__: one for one in (sign, over, power, root)}
_MODULE = '''\
"""{title}: written by winchkit export-model; Python without other packages, SI units."""

import math
{functions}
{constants}
{helpers}

class {name}:
    """Call it once for each sample, in order of time; returns {outputs}.

{inputs}
    """

    def __init__(self):
        self.before = None
{starts}
    def __call__(self, {arguments}):
        now = ({arguments})
        {before} = self.before or (time - 1e-4, *now[1:])
{body}        self.before = now
        return {results}
'''


def python_module(profile: WinchProfile, terms: Sequence[Term]) -> str:
    """The module; raises UsageError as :func:`~winchkit.dynamics.step.step_of`."""
    step, inputs, outputs = step_of(profile, terms), inputs_of(profile), outputs_of(profile)
    names = {c.name: c.name.upper() for c in step.constants}
    names |= {prefix + n: prefix + name for n, (name, *_) in inputs.items()
              for prefix in ("", BEFORE)}  # fmt: skip
    names |= {m.name: f"self.{m.name}" for m in step.memories}
    roots = [*step.outputs.values(), *(m.after for m in step.memories)]
    lines, found = statements(roots, names, lambda operation: operation.python, repr)
    body = [f"{name} = {right}" for name, right in lines]
    if step.memories:
        targets = ", ".join(f"self.{m.name}" for m in step.memories)
        body += [f"result = ({', '.join(found[: len(outputs)])},)"]
        body += [f"{targets} = {', '.join(found[len(outputs) :])}"]
        results = "result" if len(outputs) > 1 else "result[0]"
    else:
        results = ", ".join(found[: len(outputs)])
    text, name = "\n".join(body), identifier(profile.name).title().replace("_", "")
    used = {*re.findall(r"\w+", text), *(repr(c.value) for c in step.constants)}
    called = [name for name in _FUNCTIONS if name in used]
    told = [f"{name}, {unit}" for name, (unit, _) in outputs.items()]
    return _MODULE.format(
        title=re.sub(r'["\\]', "", profile.name),
        name=f"{name}_" if iskeyword(name) else name,
        constants="\n".join(
            f"{c.name.upper()} = {c.value!r}  # {c.unit}; {c.source}" for c in step.constants
        ),
        functions=f"from math import {', '.join(called)}\n" if called else "",
        helpers="".join(
            f"\n\n{inspect.getsource(one)}" for name, one in _HELPERS.items() if name in used
        ),
        outputs=" and ".join(told) if len(told) < 3 else f"({'; '.join(told)})",
        inputs="\n".join(f"    {name}: {what}, {unit}." for name, unit, what in inputs.values()),
        starts="".join(f"        self.{m.name} = {m.start!r}\n" for m in step.memories),
        arguments=", ".join(name for name, *_ in inputs.values()),
        before=", ".join(BEFORE + name for name, *_ in inputs.values()),
        body="".join(f"        {line}\n" for line in body),
        results=results,
    )
