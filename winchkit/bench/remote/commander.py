"""Who commands each winch of a bench: one client at a time, from its first order on.

A client commands a winch from the first motion that it orders until it leaves, releases it, or
another client takes it over explicitly. Everybody may stop, at any time.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from winchkit.bench.control.dead_man import DEAD_MAN, LIFE_SIGN
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.remote.identity import Client
from winchkit.drivers.clock import Clock
from winchkit.errors import MotionError, NotPermitted


class NotCommander(NotPermitted):
    """Another client commands the winch, or did until a moment ago."""


class NotReleased(NotPermitted):
    """A command that is repeated where it was refused or ended: it is no new one."""


class Commanded(Protocol):
    """A winch as far as its commander goes."""

    commander: str
    """Name of the client that commands it; empty where there is none."""


class Commanders:
    """Grants, refuses and hands over the command of winches; thread-safe.

    Calls act for the client of the innermost :meth:`acting` of their thread, else for the program
    that owns the bench.
    """

    def __init__(
        self,
        winches: Mapping[str, Commanded],
        clock: Clock,
        owner: Client,
        run_down: Callable[[str], None],
    ) -> None:
        """Take winches by name; ``run_down`` ramps one to rest when it is taken over."""
        self.owner = owner
        self._winches, self._clock, self._run_down = winches, clock, run_down
        self._holders: dict[str, Client] = {}
        self._taken: dict[tuple[Client, str], str] = {}
        self._pressed: dict[tuple[Client, str], float] = {}
        self._actor: ContextVar[Client] = ContextVar("actor", default=owner)
        self._lock = threading.RLock()

    @property
    def actor(self) -> Client:
        """The client for whom this thread acts."""
        return self._actor.get()

    @contextmanager
    def acting(self, client: Client) -> Iterator[None]:
        """Act for a client in this thread."""
        token = self._actor.set(client)
        try:
            yield
        finally:
            self._actor.reset(token)

    def holder(self, winch: str) -> Client | None:
        """Client that commands a winch; None without one."""
        return self._holders.get(winch)

    def held_by(self, client: Client) -> set[str]:
        """Winches that a client commands."""
        with self._lock:
            return {winch for winch, holder in self._holders.items() if holder is client}

    def require(self, winch: str) -> None:
        """Raise NotPermitted, naming the commander, where another client commands the winch."""
        with self._lock:
            holder = self._holders.get(winch)
            if holder is not None and holder is not self.actor:
                raise NotCommander(
                    f"winch {winch} is commanded by {holder.name}; end that one first, or take "
                    "the winch over (--take-over)"
                )

    def press(self, winch: str) -> None:
        """Note that a held motion is to begin; raises NotReleased for a repeat of the last call.

        A program that repeats the command instead of refreshing the motion would move the winch
        again after whatever has ended it.
        """
        with self._lock:
            key, now = (self.actor, winch), self._clock.now()
            before = self._pressed.get(key)
            self._pressed[key] = now
        if before is not None and now - before < DEAD_MAN:
            raise NotReleased(
                f"winch {winch}: this command repeats the one of {now - before:.2f} s ago and is "
                "no new one: go on by refresh(), or release() the winch first"
            )

    def let_go(self, winch: str) -> None:
        """Note that the acting client holds nothing any more."""
        with self._lock:
            self._pressed.pop((self.actor, winch), None)

    def claim(self, winch: str) -> None:
        """Command a winch from now on; raises as :meth:`require`."""
        with self.claimed(winch):
            pass

    @contextmanager
    def claimed(self, winch: str) -> Iterator[None]:
        """Command a winch, without handover while this lasts; raises as ``require``."""
        with self._lock:
            self.require(winch)
            self._give(winch, self.actor)
            yield

    def take_over(self, winch: str) -> None:
        """Command a winch that another client commands; its motion ends by a ramp to rest."""
        with self._lock:
            actor, holder = self.actor, self._holders.get(winch)
            if holder is not None and holder is not actor:
                self._taken[holder, winch] = actor.name
                self._run_down(winch)
            self._give(winch, actor)

    def release(self, winch: str) -> None:
        """Release a winch to the next client that commands it; only its commander can do this."""
        with self._lock:
            if self._holders.get(winch) is self.actor:
                del self._holders[winch]
                self._winches[winch].commander = ""

    def leave(self, client: Client) -> None:
        """Forget a client, and release the winches that it commands."""
        with self._lock, self.acting(client):
            for winch in self.held_by(client):
                self.release(winch)
            for kept in (self._taken, self._pressed):
                for key in [key for key in kept if key[0] is client]:
                    del kept[key]

    def raise_taken(self, winch: str) -> None:
        """Raise MotionError naming who has taken this winch over from the acting client."""
        by = self._taken.get((self.actor, winch))
        if by is not None:
            raise MotionError(f"winch {winch} was taken over by {by}; the motion before it ended")

    def _give(self, winch: str, client: Client) -> None:
        client.heard()
        self._holders[winch] = client
        self._taken.pop((client, winch), None)
        self._winches[winch].commander = client.name


class LifeSigns:
    """Called once a cycle; ends the motions of clients that have fallen silent."""

    def __init__(
        self,
        moved: Callable[[], Iterable[tuple[str, Client]]],
        end: Callable[[Client, list[str], str], None],
    ) -> None:
        """Take the winches that go on, and what ramps those of a client to rest, with a reason."""
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
