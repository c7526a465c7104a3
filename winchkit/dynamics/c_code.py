"""A profile as one header in C99: a step, a batch, and the inverse kinematics.

It needs math.h only and allocates nothing. Numbers are double, or float where ``WINCHKIT_FLOAT`` is
defined before the header is included.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import isinf, isnan
from textwrap import indent

from winchkit.dynamics.expression import Expression, Operation, derivative, ordered, statements
from winchkit.dynamics.step import BEFORE, OUTPUTS, inputs_of, outputs_of, step_of
from winchkit.effects.term import Term
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

_HEAD = """\
/* {name}: written by winchkit export-model.

   C99, no library but math.h, no allocation; SI units. Define WINCHKIT_FLOAT before this header for
   float in place of double. Call {p}_start once, then {p}_step for each sample in order of time. */
#ifndef {P}_H
#define {P}_H
#include <math.h>
#include <stddef.h>

#ifdef WINCHKIT_FLOAT
typedef float {p}_real;
#define {P}_F(name) name##f
#else
typedef double {p}_real;
#define {P}_F(name) name
#endif

"""
_STEP = """\

static inline void {p}_start({p}_state *state)
{{
    state->is_started = 0;
{starts}}}

static inline void {p}_step({p}_state *state, const {p}_input *input, {p}_output *output)
{{
    if (!state->is_started) {{
        state->before = *input;
        state->before.time -= ({p}_real)1e-4;
        state->is_started = 1;
    }}
{body}    state->before = *input;
}}

static inline void {p}_batch({p}_state *state, const {p}_input *inputs, {p}_output *outputs,
                            size_t count)
{{
    for (size_t i = 0; i < count; ++i)
        {p}_step(state, &inputs[i], &outputs[i]);
}}

"""
_AT_REST = """\
/* At rest, without memory: length (m) and arm (m/rad) at a motor angle (rad) and a load (N). */
static inline void {p}_at_rest({p}_real motor_angle, {p}_real load, {p}_real *length, {p}_real *arm)
{{
    (void)motor_angle;
    (void)load;
{rest}}}

/* At rest: motor angle (rad) at a length (m) under a load (N), by Newton from the nominal line. */
static inline {p}_real {p}_motor_angle({p}_real length, {p}_real load)
{{
    {p}_real angle;
    (void)load;
    {{
{nominal}    }}
    for (int i = 0; i < 5; ++i) {{
        {p}_real there, slope, step;
        {{
{newton}        }}
        angle += step = (length - there) / slope;
        if ({P}_F(fabs)(step) < ({p}_real){settled} * (1 + {P}_F(fabs)(angle)))
            break;
    }}
    return angle;
}}

"""
_SETTLED = 1e-13
"""Newton step, as a share, that ends the iteration; rounding makes 1e-15. The next step is smaller
by a tenth at least: at a new layer the slope of a drum jumps by a share of its radius."""


def c_header(profile: WinchProfile, terms: Sequence[Term]) -> str:
    """The header of a profile; raises UsageError as :func:`~winchkit.dynamics.step.step_of`."""
    p = identifier(profile.name)
    step = step_of(profile, terms, p)
    fields = {"p": p, "P": p.upper(), "name": in_comment(profile.name)}
    out = [_HEAD.format(**fields)]
    for c in step.constants:
        value = c_literal(c.value, p)
        what = f"{c.unit}; {in_comment(c.source)}"
        out.append(f"#define {p.upper()}_{c.name.upper()} {value} /* {what} */\n")
    inputs = inputs_of(profile)
    members = {name: told for name, *told in inputs.values()}
    out += [_struct(p, "input", members), _struct(p, "output", outputs_of(profile))]
    memory = {m.name: ("1", "memory of the effect") for m in step.memories}
    state = _struct(p, "state", memory).replace(
        "{\n", f"{{\n    int is_started;\n    {p}_input before;\n", 1
    )
    out.append(state)
    starts = "".join(f"    state->{m.name} = {c_literal(m.start, p)};\n" for m in step.memories)
    constants = {c.name: f"{p.upper()}_{c.name.upper()}" for c in step.constants}
    names = constants | {symbol: f"input->{name}" for symbol, (name, *_) in inputs.items()}
    names |= {BEFORE + n: f"state->before.{name}" for n, (name, *_) in inputs.items()}
    names |= {m.name: f"state->{m.name}" for m in step.memories}
    targets = [f"output->{n}" for n in step.outputs] + [f"state->{m.name}" for m in step.memories]
    roots = [*step.outputs.values(), *(m.after for m in step.memories)]
    body = c_body(p, roots, targets, names)
    out.append(_STEP.format(**fields, starts=starts, body=body))
    if not isinstance(profile, AxisProfile):
        rest = c_body(p, step.at_rest, ["*length", "*arm"], constants)
        slope = derivative(step.at_rest[0], "motor_angle")
        at_angle = constants | {"motor_angle": "angle"}
        newton = c_body(p, [step.at_rest[0], slope], ["there", "slope"], at_angle)
        nominal = c_body(p, [step.nominal_angle], ["angle"], constants)
        out.append(_AT_REST.format(
            **fields, rest=rest, nominal=indent(nominal, " " * 4), newton=indent(newton, " " * 8),
            settled=_SETTLED,
        ))  # fmt: skip
    return "".join([*out, "#endif\n"])


def in_comment(name: str) -> str:
    """A name of a profile, which may begin and end no comment of C."""
    return name.replace("*/", "* /").replace("/*", "/ *")


def identifier(name: str) -> str:
    """A name of C from a name of a profile."""
    found = re.sub(r"\W", "_", name, flags=re.ASCII).lower()
    return found if found[:1].isalpha() else f"model_{found}"


def _struct(p: str, kind: str, members: Mapping[str, Sequence[str]]) -> str:
    lines = "".join(
        f"    {p}_real {name}; /* {unit}, {text} */\n" for name, (unit, text) in members.items()
    )
    return f"\ntypedef struct {{\n{lines}}} {p}_{kind};\n"


def c_literal(value: float, p: str) -> str:
    """A number of C."""
    text = (
        "NAN" if isnan(value) else f"{'-' * (value < 0)}INFINITY" if isinf(value) else repr(value)
    )
    return f"(({p}_real){text})"


def c_body(
    p: str, roots: Sequence[Expression], targets: Sequence[str], names: Mapping[str, str]
) -> str:
    """Statements that assign expressions to ``targets``; ``names`` are of their symbols."""

    def text(operation: Operation) -> str:
        return operation.c.replace("F(", f"{p.upper()}_F(").replace("(real)", f"({p}_real)")

    lines, results = statements(roots, names, text, lambda value: c_literal(value, p))
    # Every result is computed before the first target, which may be an input of another.
    body = "".join(f"    const {p}_real {name} = {right};\n" for name, right in lines)
    body += "".join(f"    const {p}_real r{i} = {one};\n" for i, one in enumerate(results))
    return body + "".join(f"    {target} = r{i};\n" for i, target in enumerate(targets))


def json_number(value: float) -> float | str:
    """A number, or its name in JavaScript, Python and Protocol Buffers where JSON has none."""
    if isnan(value):
        return "NaN"
    return f"{'-' * (value < 0)}Infinity" if isinf(value) else value


def assigned(
    roots: Sequence[Expression], names: Mapping[str, str]
) -> tuple[list[list[object]], list[str]]:
    """Assignments ``[name, operation, arguments]`` that compute expressions, and the name or number
    of each; ``names`` are of their symbols. Arguments are names, or numbers as by
    :func:`json_number`."""
    values: dict[int, str] = {}
    assignments: list[list[object]] = []
    for x in ordered(roots):
        if not x.arguments:
            values[id(x)] = names.get(x.name, x.name) or str(json_number(x.value))
            continue
        values[id(x)] = f"t{len(assignments)}"
        arguments = [
            values[id(a)] if a.name or a.arguments else json_number(a.value) for a in x.arguments
        ]
        assignments.append([values[id(x)], x.operation, *arguments])
    return assignments, [values[id(x)] for x in roots]


def as_json(profile: WinchProfile, terms: Sequence[Term]) -> dict[str, object]:
    """The same step as plain data: constants, and its assignments."""
    step, inputs = step_of(profile, terms), inputs_of(profile)
    own = {BEFORE * past + n: BEFORE * past + name
           for n, (name, *_) in inputs.items() for past in (0, 1)}  # fmt: skip
    roots = [*step.outputs.values(), *(m.after for m in step.memories)]
    assignments, values = assigned(roots, own)
    after = values[len(step.outputs) :]
    return {
        "schema": 1,
        "profile": profile.name,
        "inputs": {n: {"unit": u, "what": w} for n, u, w in inputs.values()},
        "before": f"the same of the sample before, with the prefix {BEFORE}",
        "constants": {c.name: {"value": json_number(c.value), "unit": c.unit, "source": c.source}
                      for c in step.constants},
        "assignments": assignments,
        "outputs": {n: {"value": x, "unit": OUTPUTS[n][0]}
                    for n, x in zip(step.outputs, values, strict=False)},
        "memory": {m.name: {"start": json_number(m.start), "next": x}
                   for m, x in zip(step.memories, after, strict=True)},
    }  # fmt: skip
