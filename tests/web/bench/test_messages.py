"""Messages of a browser that end in motion: what is no length or speed moves nothing."""

from __future__ import annotations

import asyncio
import json
import math
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

pytest.importorskip("starlette")

from hypothesis import given, settings
from hypothesis import strategies as st

from declared import ONE_WINCH
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import MotionError, NotPermitted, UsageError
from winchkit.web.bench.browser import Browser
from winchkit.web.bench.messages import decoded
from winchkit.web.bench.programmes import Programmes
from winchkit.web.bench.view import BenchView
from winchkit.web.words import INTERNAL

MOTIONS = {"jog", "step", "move", "move_pose"}
"""Calls of a station that move something."""


@dataclass
class Station:
    """Notes the calls of a station; an error of it is raised once."""

    calls: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = field(default_factory=list)
    error: Exception | None = None

    def __getattr__(self, name: str) -> Any:
        def call(*given: Any, **named: Any) -> dict[str, Any]:
            error, self.error = self.error, None
            if error is not None:
                raise error
            self.calls.append((name, given, named))
            return {"moving": name == "moving"}

        return call

    @property
    def moved(self) -> list[tuple[str, tuple[Any, ...], dict[str, Any]]]:
        return [call for call in self.calls if call[0] in MOTIONS]


@dataclass
class Page:
    """A commanding page of a view without a bench."""

    view: BenchView
    browser: Browser
    station: Station
    loop: asyncio.Runner

    def send(self, *orders: Mapping[str, Any]) -> str:
        """Let the view carry out messages as JSON brings them; what it says after the last."""

        async def obey() -> None:
            obeying = asyncio.ensure_future(self.view._obeying(self.browser))
            self.browser.shown = ""
            for asked in (*orders, {"do": "show", "winch": "A"}):
                self.browser.inbox.put(decoded(json.dumps(asked)))
                while self.browser.inbox._waiting:
                    await asyncio.sleep(0)
            while not self.browser.shown:
                assert not obeying.done(), "a message ended the obedience"
                await asyncio.sleep(0)
            obeying.cancel()

        self.loop.run(obey())
        return str(self.browser.said["text"])


@pytest.fixture(scope="module")
def bench_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bench") / "bench.toml"
    path.write_text(ONE_WINCH)
    return path


@pytest.fixture(scope="module")
def view(bench_file: Path) -> BenchView:
    return BenchView(str(bench_file), allow_motion=True, folder=bench_file.parent)


@pytest.fixture(scope="module")
def loop() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as found:
        yield found


@pytest.fixture
def page(view: BenchView, loop: asyncio.Runner) -> Page:
    return commanding(view, loop)


def commanding(view: BenchView, loop: asyncio.Runner) -> Page:
    folder = view.folder
    browser = Browser("page", view.spec, Programmes(view.spec, folder, folder))
    station = Station()
    browser.take(station)  # type: ignore[arg-type]
    view._commander = browser
    return Page(view, browser, station, loop)


def now() -> float:
    return time.monotonic()


LENGTH = "is not a length. Type metres, for example 2.5."


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "No length is given. Type metres, for example 2.5."),
        ("", f'"" {LENGTH}'),
        ("2,5 m", f'"2,5 m" {LENGTH}'),
        ("2.5", f'"2.5" {LENGTH}'),
        (math.nan, f'"NaN" {LENGTH}'),
        (math.inf, f'"Infinity" {LENGTH}'),
        (True, f'"true" {LENGTH}'),
        (-0.5, f'"-0.5" {LENGTH}'),
        ([2.5], f'"[2.5]" {LENGTH}'),
        (10**400, f'"1{"0" * 39}…" {LENGTH}'),
    ],
)
def test_what_is_no_length_moves_nothing_and_is_said_in_a_sentence(
    page: Page, value: object, words: str
) -> None:
    order = {"do": "move", "winch": "A", "to": value, "speed": 0.05, "seen": now()}
    assert page.send(order) == words
    assert page.send({key: item for key, item in order.items() if key != "to"}).startswith("No len")
    assert page.station.calls == []


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([10**400, -(10**400)]),
    st.floats(),
    st.floats(0.001, 5.0),
    st.text(max_size=12),
    st.sampled_from(["A", "B", "all", "x", "2,5 m", "nan"]),
    st.lists(st.floats(), max_size=2),
    st.dictionaries(st.text(max_size=3), st.none(), max_size=2),
)
FIELDS = ("winch", "speed", "to", "change", "axis")


def number(value: object) -> bool:
    """Whether a JSON value is a number of the real line that a float holds."""
    return type(value) in (int, float) and -1.7e308 < value < 1.7e308  # type: ignore[operator]


def right(asked: Mapping[str, Any]) -> bool:
    """Whether a motion message says everything that it must, by its documentation."""
    winch, speed = asked.get("winch") == "A", asked.get("speed")
    forward = number(speed) and float(speed) > 0  # type: ignore[arg-type]
    change = number(asked.get("change")) and float(asked["change"]) != 0
    return {
        "jog": winch and number(speed) and float(speed) != 0,  # type: ignore[arg-type]
        "step": winch and change and forward,
        "move": winch and number(asked.get("to")) and asked["to"] >= 0 and forward,
        "move_pose": asked.get("axis") in ("x", "y", "z") and change and forward,
    }[asked["do"]]


@settings(max_examples=300, deadline=None)
@given(
    do=st.sampled_from(sorted(MOTIONS)),
    given=st.dictionaries(st.sampled_from(FIELDS), VALUES),
    right_ones=st.sets(st.sampled_from(FIELDS)),
)
def test_only_whole_messages_of_finite_numbers_reach_the_station(
    view: BenchView, loop: asyncio.Runner, do: str, given: dict[str, Any], right_ones: set[str]
) -> None:
    good = {"winch": "A", "speed": 0.05, "to": 2.5, "change": -0.01, "axis": "z"}
    asked = {"do": do, **given, **{key: good[key] for key in right_ones}, "seen": 1.0}
    page = commanding(view, loop)
    with mock.patch.object(MonotonicClock, "now", return_value=1.0):  # a stall makes none old
        said = page.send(asked)
    if right(asked):
        assert [call[0] for call in page.station.calls] == [do]
        assert said == ""
    else:
        assert page.station.calls == []
        assert re.match(r'(".*"|No [a-z ]+) is ', said, re.DOTALL), said
    for _, given_values, named in page.station.moved:
        values = [*named.values(), *(v for v in given_values if isinstance(v, float))]
        assert all(type(value) is float and math.isfinite(value) for value in values)


@pytest.mark.parametrize(
    "seen", [None, True, "now", math.nan, -math.inf, math.inf, 0.0, "late", "ahead"]
)
@pytest.mark.parametrize("do", ["jog", "step", "move", "move_pose", "run_programme", "reset"])
def test_an_order_of_somebody_who_did_not_see_the_bench_begins_nothing(
    page: Page, do: str, seen: object
) -> None:
    values = {"late": now() - 1.5, "ahead": now() + 60}
    seen = values.get(seen, seen) if isinstance(seen, str) else seen
    asked = {"do": do, "winch": "A", "speed": 0.05, "to": 2.5, "change": 0.01, "axis": "z"}
    said = page.send({**asked, "name": "x", "folder": "runs", "seen": seen})
    assert page.station.calls == []
    assert "too slow" in said or "came late" in said


def test_what_ends_something_may_come_late(page: Page) -> None:
    page.send({"do": "release", "winch": "A", "seen": now() - 9}, {"do": "programme"})
    assert [call[0] for call in page.station.calls] == ["release", "programme"]


def test_a_page_that_only_watches_orders_nothing_and_its_late_signs_of_life_are_silent(
    page: Page,
) -> None:
    page.view._commander = None
    assert page.send({"do": "release", "winch": "A"}, {"do": "alive", "winch": "A"}) == ""
    assert "only watches" in page.send({"do": "jog", "winch": "A", "speed": 0.1, "seen": now()})
    assert page.station.calls == []


@pytest.fixture
def other(page: Page, monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    """A second open page, which watches."""
    monkeypatch.setattr("winchkit.web.bench.view.attach", lambda *_, **__: Station())
    folder = page.view.folder
    browser = Browser("other", page.view.spec, Programmes(page.view.spec, folder, folder))
    page.view._open |= {page.browser, browser}
    yield Page(page.view, browser, page.station, page.loop)
    page.view._open.clear()
    page.view._requesting = None


def test_a_page_requests_the_command_and_gets_it_when_it_is_handed_over(
    page: Page, other: Page
) -> None:
    view = page.view
    assert other.send({"do": "command"}) == ""
    assert (view._commander, view._requesting) == (page.browser, other.browser)
    page.send({"do": "keep_command"})
    assert (view._commander, view._requesting) == (page.browser, None)
    assert other.browser.said["text"] == "The other page keeps the command."
    other.send({"do": "command"}, {"do": "leave"})
    assert view._requesting is None, "withdrawn"
    other.send({"do": "command"})
    page.send({"do": "leave"})
    assert (view._commander, view._requesting) == (other.browser, None)
    assert page.station.calls[-1][0] == "close"


def test_a_page_that_closes_while_it_gets_the_command_does_not_keep_it(
    page: Page, other: Page
) -> None:
    page.send({"do": "leave"})
    page.view._open.discard(other.browser)
    other.send({"do": "command"})
    assert page.view._commander is None


def test_what_ended_a_motion_is_reported_once_and_only_to_the_page_that_ordered_it(
    page: Page,
) -> None:
    alive, stopped = {"do": "alive", "winch": "A"}, MotionError("winch A was stopped")
    page.send(alive)
    assert page.station.calls == []
    page.send({"do": "move", "winch": "A", "to": 2.5, "speed": 0.05, "seen": now()}, alive)
    assert [call[0] for call in page.station.calls] == ["move", "moving"]
    page.station.error = stopped
    assert page.send(alive, alive) == str(stopped)
    assert page.browser.said["number"] == 1
    assert len(page.station.calls) == 2


def test_a_refused_jog_is_not_taken_up_before_it_is_released(page: Page) -> None:
    page.station.error = NotPermitted("winch A: only winding in is allowed")
    jog = {"do": "jog", "winch": "A", "speed": -0.05}
    held = {**jog, "do": "refresh"}
    said = page.send({**jog, "seen": now()}, {**held, "seen": now()}, {**held, "seen": now()})
    assert said == "winch A: only winding in is allowed"
    assert page.station.calls == []
    page.send({"do": "release", "winch": "A"}, {**jog, "seen": now()}, {**held, "seen": now()})
    assert [call[0] for call in page.station.calls] == ["release", "jog", "refresh"]


def test_a_message_that_repeats_is_said_again_and_one_that_is_over_goes(page: Page) -> None:
    wrong = {"do": "move", "winch": "A", "to": "x", "speed": 0.05, "seen": now()}
    first = page.send(wrong)
    number = page.browser.said["number"]
    assert page.send(wrong) == first
    assert page.browser.said["number"] == number + 1
    assert page.send({"do": "release", "winch": "A"}, {"do": "show", "winch": "A"}) == first
    assert page.send({**wrong, "to": 2.5, "seen": now()}) == ""


def test_a_defect_is_said_and_the_page_goes_on(page: Page) -> None:
    page.station.error = RuntimeError("broken")
    asked = {"do": "move", "winch": "A", "to": 2.5, "speed": 0.05}
    assert page.send({**asked, "seen": now()}) == f"The order {INTERNAL}."
    assert page.send({**asked, "seen": now()}) == ""
    assert [call[0] for call in page.station.calls] == ["move"]


@pytest.mark.parametrize("text", ["", "null", "[]", "{", "[" * 3000, '{"do": 1' + " " * 4000 + "}"])
def test_what_is_no_object_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="no JSON object"):
        decoded(text)


def test_a_tare_is_undone_with_what_it_was_before(page: Page) -> None:
    seen: Sequence[Mapping[str, Any]] = [
        {"do": do, "winch": "A", "seen": now()} for do in ("undo_tare", "tare", "undo_tare")
    ]
    assert "has not tared winch A" in page.send(seen[0])
    page.send(seen[1])
    assert page.browser.undo_tare == ["A"]
    page.send(seen[2])
    assert page.browser.undo_tare == []
    assert [call[:2] for call in page.station.calls] == [
        ("cell", ("tares", "A.cell")),
        ("tare", ("A",)),
        ("cell", ("restore tares", "A.cell", {"moving": False})),
    ]
