"""Whoever moves the winches: holds keys, sends moves, runs a programme, and does not give up."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from fault_cases.case import Case
from fault_cases.world import World
from winchkit.bench.winch import Winch
from winchkit.drivers.scheduling import thread_of

_REPEAT = 0.05
"""Of a held key, s."""
_WAYS = {"move": (-1.2, 0.65), "programme": (-0.15, 0.15)}
"""Of a move winding in and paying out, and of a programme's moves, m."""


class Operator:
    """Moves every winch of a world until it ends; what is refused is tried again at once."""

    def __init__(self, world: World, case: Case) -> None:
        """Begin."""
        self._world, self._case = world, case
        self.holds = True
        """Whether the keys are held."""
        self.orders = True
        """Whether moves are sent."""
        self.errors: list[tuple[float, BaseException]] = []
        """What refused a command, and when, s."""
        self.acknowledged: list[float] = []
        """When each command was accepted, s."""
        self._threads = []
        for winch in world.bench.winch.values():
            work = self._jogging(winch) if case.motion == "jog" else self._moving(winch)
            thread = thread_of(world.clock, work, f"operator {winch.name}")
            thread.start()
            self._threads.append(thread)

    def let_go(self) -> None:
        """Release every key and wait for whoever moves something."""
        self.holds = self.orders = False
        for thread in self._threads:
            thread.join(20.0)

    def _jogging(self, winch: Winch) -> Callable[[], None]:
        direction = "pay_out" if self._case.paying_out else "wind_in"

        def work() -> None:
            self._try(lambda: winch.jog(**{direction: self._case.speed}))
            while self.holds:
                self._world.clock.sleep(_REPEAT)
                self._try(winch.refresh)

        return work

    def _moving(self, winch: Winch) -> Callable[[], None]:
        inwards, outwards = _WAYS[self._case.motion]
        first, second = (outwards, inwards) if self._case.paying_out else (inwards, outwards)
        ways = [first] if self._case.motion == "move" else [first, second]

        def work() -> None:
            self._world.clock.sleep(0.01)
            start = winch.cable_length
            while self.orders:
                for way in ways:
                    if self.orders:
                        self._try(partial(winch.move_to, start + way, speed=self._case.speed))
                        self._world.clock.sleep(_REPEAT)

        return work

    def _try(self, command: Callable[[], object]) -> None:
        try:
            command()
        except Exception as error:  # noqa: BLE001 - a script that goes on whatever happens
            self.errors.append((self._world.now, error))
        else:
            self.acknowledged.append(self._world.now)

    def reset(self) -> str:
        """Reset the bench; what was refused in words, empty where it was done."""
        try:
            self._world.bench.reset()
        except Exception as error:  # noqa: BLE001 - judged by what then moves
            return f"{type(error).__name__}: {error}"
        return ""
