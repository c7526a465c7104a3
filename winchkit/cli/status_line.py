"""The winches of a bench in one line."""

from __future__ import annotations

from typing import Any

__all__ = ["status_line"]


def status_line(status: dict[str, Any]) -> str:
    """Length, cable speed (positive pays out), tension and phase of each winch of a status.

    Beside the length that the profile says, what an instrument shows, where there is one.
    """
    parts = []
    for name, winch in status["winch"].items():
        text = f"{name}: {_number(winch['cable_length'])} m"
        if winch["length"] is not None:
            text += f" (measured {_number(winch['length'], 4)} m)"
        text += f" {_number(winch['cable_speed'])} m/s"
        if winch["rope_tension"] is not None:
            text += f" {_number(winch['rope_tension'], 1)} N"
        parts.append(f"{text} {winch['phase']}")
    return "  ".join(parts)


def _number(value: float | None, digits: int = 3) -> str:
    return "—" if value is None else f"{value:.{digits}f}"
