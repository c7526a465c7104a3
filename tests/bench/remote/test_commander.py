"""Who commands a winch: granted, refused by name, taken over, released; on a clock of its own."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from winchkit.bench.remote.commander import Commanders, NotCommander, NotReleased
from winchkit.bench.remote.identity import Client, client_name
from winchkit.errors import MotionError

FIRST, SECOND = Client("first"), Client("second")


class Clock:
    """Time that the test sets."""

    def __init__(self) -> None:
        self.time = 10.0

    def now(self) -> float:
        return self.time

    def sleep(self, duration: float) -> None:
        self.time += duration


@dataclass
class Winch:
    commander: str = ""


class Rig:
    """Two winches and what was ramped to rest."""

    def __init__(self) -> None:
        self.clock, self.winches = Clock(), {"A": Winch(), "B": Winch()}
        self.stopped: list[str] = []
        self.commanders = Commanders(self.winches, self.clock, Client("owner"), self.stopped.append)

    def claim(self, client: Client, winch: str = "A") -> None:
        with self.commanders.acting(client):
            self.commanders.claim(winch)

    def take_over(self, client: Client, winch: str = "A") -> None:
        with self.commanders.acting(client):
            self.commanders.take_over(winch)


def test_the_first_order_gives_the_command_and_the_next_client_is_refused_by_name() -> None:
    rig = Rig()
    rig.claim(FIRST)
    with pytest.raises(NotCommander, match="winch A is commanded by first; end that one first"):
        rig.claim(SECOND)
    assert rig.winches["A"].commander == "first"
    rig.claim(FIRST)
    rig.claim(SECOND, "B")
    assert rig.commanders.held_by(SECOND) == {"B"}
    assert rig.stopped == [], "nothing changes for the first"


def test_whoever_owns_the_bench_is_a_client_as_any_other() -> None:
    rig = Rig()
    rig.commanders.claim("A")
    with pytest.raises(NotCommander, match="commanded by owner"):
        rig.claim(FIRST)
    rig.take_over(FIRST)
    with pytest.raises(NotCommander, match="commanded by first"):
        rig.commanders.claim("A")


def test_a_hand_over_ends_the_motion_and_is_reported_to_the_one_who_lost_it() -> None:
    rig = Rig()
    rig.claim(FIRST)
    rig.take_over(SECOND)
    assert rig.stopped == ["A"]
    assert rig.winches["A"].commander == "second"
    with rig.commanders.acting(FIRST):
        with pytest.raises(MotionError, match="winch A was taken over by second"):
            rig.commanders.raise_taken("A")
        with pytest.raises(NotCommander, match="commanded by second"):
            rig.commanders.claim("A")
    with rig.commanders.acting(SECOND):
        rig.commanders.raise_taken("A")
    rig.take_over(SECOND)
    assert rig.stopped == ["A"], "who commands it already moves on"


def test_a_command_that_is_repeated_is_no_new_one_before_it_was_released() -> None:
    """Whatever has ended the motion meanwhile: a program that forgets to refresh moves nothing."""
    rig = Rig()
    with rig.commanders.acting(FIRST):
        rig.commanders.press("A")
        for _ in range(20):
            rig.clock.sleep(0.15)
            with pytest.raises(NotReleased, match="go on by refresh"):
                rig.commanders.press("A")
        rig.commanders.press("B")
        rig.clock.sleep(0.25)
        rig.commanders.press("A")
        rig.commanders.let_go("A")
        rig.commanders.press("A")
    with rig.commanders.acting(SECOND):
        rig.commanders.press("A")


def test_only_its_commander_releases_a_winch_and_leaving_releases_all() -> None:
    rig = Rig()
    rig.claim(FIRST)
    rig.claim(FIRST, "B")
    with rig.commanders.acting(SECOND):
        rig.commanders.release("A")
    assert rig.commanders.holder("A") is FIRST
    rig.commanders.leave(FIRST)
    assert rig.commanders.held_by(FIRST) == set()
    rig.claim(SECOND)


def test_two_clients_of_one_name_are_two() -> None:
    rig = Rig()
    rig.claim(Client("jog"))
    with pytest.raises(NotCommander):
        rig.claim(Client("jog"))


def test_a_client_is_named_by_its_command_process_and_user() -> None:
    import os

    assert client_name("jog").startswith(f"jog (process {os.getpid()}, user ")
