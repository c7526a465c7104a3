"""The last answer to a question about a fit, kept while the same fit is asked about again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.noise import Noise

__all__ = ["Last"]

Answer = TypeVar("Answer")


class Last(Generic[Answer]):
    """Answers for a fit and a noise; the very same objects get the answer of the last time."""

    def __init__(self) -> None:
        self._kept: tuple[Fit, Noise, Answer] | None = None

    def of(self, fit: Fit, noise: Noise, compute: Callable[[], Answer]) -> Answer:
        """The answer, computed where another fit or noise was asked about last."""
        if self._kept is None or self._kept[0] is not fit or self._kept[1] is not noise:
            self._kept = fit, noise, compute()
        return self._kept[2]
