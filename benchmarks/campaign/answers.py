"""Log of a campaign: scores as lines of JSON, and the cases that a log has already."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

S = TypeVar("S")


def keep(score: Any, log: Path | None) -> None:
    """Append a score (a dataclass) to a log, if there is one."""
    if log is not None:
        with log.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(asdict(score)) + "\n")


def kept(log: Path | None, read: Callable[[Mapping[str, Any]], S]) -> dict[int, S]:
    """Scores of a log by their seeds, each made of a line by ``read``."""
    if log is None or not log.exists():
        return {}
    lines = map(json.loads, log.read_text(encoding="utf-8").splitlines())
    return {int(line["seed"]): read(line) for line in lines}
