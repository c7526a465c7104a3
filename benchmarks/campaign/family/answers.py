"""Answers of the diagnosis to a family's cases, each within a limit of processor time."""

from __future__ import annotations

import signal
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class TimeLimit(BaseException):
    """The limit of processor time; no ``except Exception`` of a search may keep it."""


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    def stop(*_: Any) -> None:
        raise TimeLimit

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def answer(runs: Sequence[Path], profile: Path, limit: float) -> dict[str, Any]:
    """What the diagnosis reports on files: what a score needs, as plain JSON.

    ``verdict`` is also ``refused`` (an error that says what to do), ``timeout`` or
    ``crash``; ``text`` says why.
    """
    from winchkit import diagnose, read_profile, read_run
    from winchkit.errors import WinchkitError

    begun, text = time.process_time(), ""
    told: dict[str, Any] = {}
    try:
        read = [read_run(path) for path in runs]  # unlimited: a stop while a file opens leaks it
        declared = read_profile(profile)
        with _limited(limit):
            said = diagnose(read, declared)
            told = said.diagnosis.to_json()
            verdict = told["verdict"]
    except TimeLimit:
        verdict = "timeout"
    except WinchkitError as error:
        verdict, text = "refused", str(error)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is a finding
        verdict = "crash"
        text = f"{type(error).__name__}: {error}\n{traceback.format_exc()[-1500:]}"
    return {
        "verdict": verdict,
        "steps": [_step(step) for step in told.get("steps", ())],
        "outputs": {name: _errors(output) for name, output in told.get("outputs", {}).items()},
        "detectable": _detectable(told),
        "share": (told.get("unexplained") or {}).get("share"),
        "sanity": sorted({f"{s['code']} {s['channel']}" for s in told.get("sanity", ())}),
        "caveats": list(told.get("caveats", ())),
        "nuisances": {k: told[k] for k in ("run_offsets", "used_share") if k in told},
        "seconds": round(time.process_time() - begun, 2),
        "text": text,
    }


def _step(step: dict[str, Any]) -> dict[str, Any]:
    keys = ("effects", "place", "law", "certain", "share", "heldout_gain", "doubts", "refitted")
    kept = {key: step[key] for key in keys if key in step}
    return kept | {"values": step.get("parameters", {})}


def _detectable(told: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Smallest detectable value of each parameter of the effects of the steps."""
    named = {effect for step in told.get("steps", ()) for effect in step["effects"]}
    out: dict[str, dict[str, float]] = {}
    for one in told.get("detectable", ()):
        if one["effect"] in named:
            out.setdefault(one["effect"], {})[one["parameter"]] = one["smallest"]
    return out


def _errors(output: dict[str, Any]) -> dict[str, Any]:
    return {
        "before": output.get("heldout_rms_before"),
        "after": output.get("heldout_rms_after"),
        "noise": output.get("noise_rms"),
        "noise_upper": output.get("noise_upper"),
    }
