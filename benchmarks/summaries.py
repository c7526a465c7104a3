"""Summaries of benchmarks: as JSON to stdout, or as lines of a name and its value."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any


def print_summary(summary: Mapping[str, Any], *, as_json: bool) -> None:
    """Lines to stderr, and JSON to stdout where it is asked for."""
    if as_json:
        print(json.dumps(summary))
    for name, value in summary.items():
        print(f"{name:20} {value}", file=sys.stderr)


def print_cases(
    summary: Mapping[str, Any], cases: Sequence[Mapping[str, Any]], *, as_json: bool
) -> None:
    """JSON with all cases, or lines of the summary, to stdout."""
    if as_json:
        print(json.dumps({"schema": 1, "summary": summary, "cases": cases}, indent=1))
    else:
        print("\n".join(f"{name}: {value}" for name, value in summary.items()))
