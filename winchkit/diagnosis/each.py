"""A diagnosis of every winch of a recording by itself."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

from winchkit.diagnosis.diagnose import Answer, Told, diagnose, silent
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.runs.run import Run
from winchkit.schema.winch import WinchProfile

__all__ = ["diagnose_each"]

_AT_A_TIME = 2


def diagnose_each(
    winches: Mapping[str, Sequence[Run]],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    thin: bool = True,
    told: Told = silent,
) -> Iterator[tuple[str, Answer]]:
    """Name and answer of every winch, in order, all against one profile.

    Two are worked on at a time: on long arrays numpy leaves a second core to the other. An answer
    holds hundreds of megabytes after long runs, so let go of one before taking the next.
    """
    catalogue = catalogue or load_catalogue()
    shares = dict.fromkeys(winches, 0.0)

    def one(name: str) -> Answer:
        def heard(what: str, share: float) -> None:
            shares[name] = share
            told(f"winch {name}: {what}" if name else what, sum(shares.values()) / len(shares))

        answer = diagnose(winches[name], profile, catalogue, band, thin=thin, told=heard)
        heard("done", 1.0)
        return answer

    with ThreadPoolExecutor(_AT_A_TIME) as pool:
        yield from zip(winches, pool.map(one, winches), strict=True)
