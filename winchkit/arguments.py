"""Checks of the types of public functions' arguments; an error names the call that returns it.

A path where runs are expected is the usual mistake; without a check it is an ``AttributeError``
deep in a computation.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

from winchkit.errors import UsageError, one_line

_CALLS = {
    "Addition": "add(effect, runs, profile)",
    "BenchSpec": "read_bench(path)",
    "Bench": "open_bench(bench)",
    "Calibrated": "calibrate(robot, fit)",
    "CalibrationPoint": "read_points(path)",
    "Log": "read_log(paths)",
    "MeasuredPoses": "read_poses(runs, profile)",
    "Programme": "read_programme(path)",
    "PulleyRecord": "record_of(run, profile)",
    "Removal": "remove(effect, runs, profile)",
    "Robot": "robot_of(profile)",
    "RobotAnswer": "diagnose(runs, profile)",
    "RobotProfile": "read_robot(path)",
    "Run": "read_run(path)",
    "SimBench": "read_simbench(path)",
    "SizeSpec": "read_size(path)",
    "TrackerReceiver": "TrackerReceiver(now)",
    "WinchAnswer": "diagnose(runs, profile)",
    "WinchProfile": "read_profile(path)",
}
"""Public call that returns an object of a type."""
_LONGEST_VALUE = 40
"""Characters of a wrong value that a message shows."""
ProgressCallback = Callable[[str, float | None], None]
"""Called with the present task and the share that is done, 0 to 1; None where it is not known."""


def no_progress(task: str, share: float | None) -> None:
    """Progress callback that does nothing."""


def require_type(value: object, kind: type | tuple[type, ...], name: str) -> None:
    """Raise UsageError unless a value is of a type; it names the call that returns such a value."""
    if isinstance(value, kind):
        return
    kinds = kind if isinstance(kind, tuple) else (kind,)
    expected = " or ".join(one.__name__ for one in kinds)
    calls = " or ".join(_CALLS[one.__name__] for one in kinds if one.__name__ in _CALLS)
    remedy = f": {calls}" if calls else ""
    raise UsageError(f"{name} is {_shown(value)}; pass a {expected}{remedy}")


def require_types(values: object, kind: type | tuple[type, ...], name: str) -> None:
    """Raise UsageError unless values are a sequence, such as a list, of objects of a type."""
    kinds = kind if isinstance(kind, tuple) else (kind,)
    if not isinstance(values, Sequence) or isinstance(values, str | bytes):
        expected = " or ".join(one.__name__ for one in kinds)
        calls = [_CALLS[one.__name__] for one in kinds if one.__name__ in _CALLS]
        remedy = f", each from {' or '.join(calls)}" if calls else ""
        raise UsageError(f"{name} is {_shown(values)}; pass a list of {expected}{remedy}")
    for index, value in enumerate(values):
        require_type(value, kind, f"{name}[{index}]")


def require_each(winches: object, kind: type, name: str) -> None:
    """Raise UsageError unless an argument maps names to sequences of objects of a type."""
    found = require_mapping(winches, name, f"lists of {kind.__name__} by winch")
    for key, values in found.items():
        require_types(values, kind, f"{name}[{key!r}]")


def require_mapping(values: object, name: str, what: str) -> Mapping[Any, Any]:
    """The argument where it is a mapping of ``what``; else raises UsageError."""
    if isinstance(values, Mapping):
        return values
    raise UsageError(f"{name} is {_shown(values)}; pass a dict of {what}")


def require_sequence(values: object, name: str, what: str) -> None:
    """Raise UsageError where an argument is no sequence or array; ``what``: the one to pass."""
    if isinstance(values, str) or not (isinstance(values, Sequence) or hasattr(values, "dtype")):
        raise UsageError(f"{name} is {_shown(values)}; pass {what}")


def path_of(value: object, name: str = "path") -> Path:
    """Argument that names a file or a folder; UsageError for what is no text and no path."""
    if not isinstance(value, str | os.PathLike) or isinstance(os.fspath(value), bytes):
        raise UsageError(f"{name} is {_shown(value)}; pass the path of a file or folder")
    return Path(value)


def number(call: str, name: str, value: object) -> float:
    """Argument that is a finite number, in SI; UsageError also for text, None and True."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise UsageError(f"{call}: {name} is {_shown(value)}; pass a number in SI units")
    if not math.isfinite(value):
        raise UsageError(f"{call}: {name}={value} is not a finite number")
    return float(value)


def positive(call: str, name: str, value: object, most: float = math.inf) -> float:
    """Argument that is a number above zero and at most ``most``, in SI; else UsageError."""
    found = number(call, name, value)
    if found <= 0:
        raise UsageError(f"{call}: {name}={found:g} is not a positive number")
    if found > most:
        raise UsageError(f"{call}: {name}={found:g} is more than {most:g}")
    return found


def _shown(value: object) -> str:
    """A value in a message: its type, and its beginning where it is text, a path or a number."""
    if value is None:
        return "None"
    kind = type(value).__name__
    article = "an" if kind[0].lower() in "aeiou" else "a"
    if not isinstance(value, str | int | float) and not hasattr(value, "__fspath__"):
        return f"{article} {kind}"
    text = one_line(str(value))
    text = text if len(text) <= _LONGEST_VALUE else text[:_LONGEST_VALUE] + "…"
    return f"{article} {kind} '{text}'"
