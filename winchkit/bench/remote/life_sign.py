"""A client in another process that has ordered a motion must stay alive: the dead-man of a move.

A jog ends by itself without a new command. A move, a step and a homing go on by themselves; they
end by a ramp when the client that commands the winch, and is connected still, has sent no request
for :data:`~winchkit.bench.control.dead_man.LIFE_SIGN` (it was suspended, or hangs).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from winchkit.bench.control.dead_man import LIFE_SIGN
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.remote.identity import Client


class LifeSigns:
    """Called once a cycle; ends the motions of clients that have fallen silent."""

    def __init__(
        self,
        moved: Callable[[], Iterable[tuple[str, Client]]],
        end: Callable[[Client, list[str], str], None],
    ) -> None:
        """Take ``moved``: winches that go on by themselves, with the client that commands each.

        ``end`` ramps the winches of a client to rest, for a reason in words.
        """
        self._moved, self._end = moved, end
        self._before = float("inf")

    def __call__(self, snapshot: BenchSnapshot) -> None:
        """Count the silence of every client whose winch moves."""
        duration, self._before = max(0.0, snapshot.time - self._before), snapshot.time
        winches: dict[Client, list[str]] = {}
        for winch, client in self._moved():
            winches.setdefault(client, []).append(winch)
        for client, names in winches.items():
            if client.life is None:
                continue
            client.life.pass_by(duration)
            if client.life.silence > LIFE_SIGN:
                self._end(
                    client,
                    names,
                    f"{client.name} gave no sign of life for {LIFE_SIGN:g} s (it was suspended, or "
                    "hangs); its motion was ended by a ramp",
                )
