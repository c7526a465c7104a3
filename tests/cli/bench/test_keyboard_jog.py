"""The keyboard of ``jog``: what each key, held, released or pressed once, asks of the station."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from winchkit.cli.bench import jog
from winchkit.errors import ConnectionLost, NotPermitted

STATUS = {
    "winch": {
        "A": {
            "cable_length": 4.0,
            "length_known": True,
            "cable_speed": None,
            "load_tension": 98.1,
            "length": None,
            "phase": "disabled",
        }
    }
}


def standing(phase: str) -> dict[str, Any]:
    """The status with winch A in a phase."""
    return {"winch": {"A": {**STATUS["winch"]["A"], "phase": phase}}}


class Station:
    """Writes down what it is asked; may refuse to jog."""

    def __init__(self, refusal: Exception | None = None) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self._refusal = refusal
        self.shown = STATUS
        self.time = 0.0

    @property
    def clock(self) -> Station:
        return self

    def now(self) -> float:
        return self.time

    def jog(self, winch: str | None, *, hold: float, since: float, **direction: float) -> None:
        assert since == self.time, "the time at which the key was read"
        ((name, speed),) = direction.items()
        self.calls.append(("jog", name, round(speed, 6), hold))
        if self._refusal is not None:
            raise self._refusal

    def refresh(self, winch: str | None, *, hold: float, **direction: float) -> None:
        ((name, speed),) = direction.items()
        self.calls.append(("refresh", name, round(speed, 6), hold))

    def release(self, winch: str | None) -> None:
        pass

    def step(self, winch: str | None, *, speed: float, since: float, **direction: float) -> None:
        assert since == self.time
        self.calls.append(("step", *direction.items()))

    def stop(self) -> None:
        self.calls.append(("stop",))

    def reset(self) -> None:
        self.calls.append(("reset",))

    def status(self) -> dict[str, Any]:
        return self.shown


def press(
    monkeypatch: pytest.MonkeyPatch, station: Station, keys: list[tuple[float, list[str]]]
) -> None:
    """Let keys come at times (s), then leave; a ``stall`` is a time in which nothing is read."""
    left = [*keys, (keys[-1][0] + 0.01, ["q"])]

    class Keyboard:
        def read(self, timeout: float) -> list[str]:
            at, pressed = left[0]
            if at > station.time + timeout and "stall" not in pressed:
                station.time += timeout
                return []
            station.time, _ = left.pop(0)
            return [key for key in pressed if key != "stall"]

    @contextmanager
    def open_keys() -> Iterator[Keyboard]:
        yield Keyboard()

    monkeypatch.setattr("winchkit.cli.bench.keyboard_jog.open_keys", open_keys)
    jog._jog_by_keys(station, "A", 0.1)  # type: ignore[arg-type]


def test_a_first_press_lasts_and_repeats_refresh_shortly(monkeypatch: pytest.MonkeyPatch) -> None:
    station = Station()
    press(monkeypatch, station, [(0.0, ["up"]), (0.5, ["up"]), (0.53, ["up"]), (2.0, ["up"])])
    held = [(call[0], call[3]) for call in station.calls if call[0] != "stop"]
    assert held == [("jog", 0.7), ("refresh", 0.2), ("refresh", 0.2), ("jog", 0.7)]
    assert station.calls[-1] == ("stop",), "q stops"


def test_arrows_give_the_direction_and_plus_and_minus_the_speed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station = Station()
    press(monkeypatch, station, [(0.0, ["up"]), (0.1, ["+", "down"]), (0.2, ["-", "-", "up"])])
    moved = [call[1:3] for call in station.calls if call[0] == "jog"]
    assert moved == [("wind_in", 0.1), ("pay_out", 0.125), ("wind_in", 0.08)]


def test_space_stops_and_r_resets(monkeypatch: pytest.MonkeyPatch) -> None:
    station = Station()
    press(monkeypatch, station, [(0.0, ["up"]), (0.1, [" "]), (0.2, ["r"]), (0.3, ["x"])])
    assert [call[0] for call in station.calls] == ["jog", "stop", "reset", "stop"]


def test_what_forbids_a_motion_is_shown_and_the_hand_stays(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    station = Station(NotPermitted("tension is too high"))
    press(monkeypatch, station, [(0.0, ["up"]), (0.1, ["down"])])
    assert [call[0] for call in station.calls] == ["jog", "jog", "stop"]
    assert "tension is too high" in capsys.readouterr().err


def test_keys_of_a_gap_move_nothing_and_neither_do_their_repeats(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Typed while this program was suspended: it is not known whether the key is still down."""
    station = Station()
    repeats = [(9.0 + 0.03 * n, ["up"]) for n in range(30)]
    keys = [(0.0, ["up"]), (0.5, ["up"]), (8.5, ["stall", *20 * ["up"]]), *repeats]
    press(monkeypatch, station, [*keys, (11.0, ["up"])])
    moved = [call[0] for call in station.calls]
    assert moved == ["jog", "refresh", "jog", "stop"], "the last one is a press after a release"
    assert "keys of the last 8.0 s are ignored" in capsys.readouterr().err


def test_a_stop_that_was_typed_in_a_gap_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    station = Station()
    press(monkeypatch, station, [(0.0, ["up"]), (8.0, ["stall", "up", " ", "i", "up"])])
    assert [call[0] for call in station.calls] == ["jog", "stop", "stop"]


def test_several_repeats_at_once_are_one(monkeypatch: pytest.MonkeyPatch) -> None:
    station = Station()
    press(monkeypatch, station, [(0.0, ["up"]), (0.5, ["up", "up", "up"]), (0.55, ["up", "up"])])
    assert [call[0] for call in station.calls] == ["jog", "refresh", "refresh", "stop"]


def test_a_lost_owner_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConnectionLost):
        press(monkeypatch, Station(ConnectionLost("gone")), [(0.0, ["up"])])


def steps(station: Station) -> list[tuple[str, float]]:
    """Lengths (m) that the taps asked for, by the keyword of their direction."""
    return [call[1] for call in station.calls if call[0] == "step"]


def test_inch_mode_makes_one_step_a_tap_of_the_length_that_is_shown(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    station = Station()
    taps = [(0.0, ["i"]), (1.0, ["up"]), (2.0, ["i", "down"]), (3.0, ["i", "up"]), (4.0, ["i"])]
    press(monkeypatch, station, [*taps, (5.0, ["up"])])
    assert steps(station) == [("wind_in", 0.001), ("pay_out", 0.01), ("wind_in", 0.1)]
    moved = [call for call in station.calls if call[0] == "jog"]
    assert moved == [("jog", "wind_in", 0.1, 0.7)], "a jog only after the mode went back to hold"
    shown = capsys.readouterr().err
    for words in ("1 mm a tap", "10 mm a tap", "100 mm a tap", "hold, 0.100 m/s"):
        assert words in shown


def test_a_key_that_is_held_is_one_tap_and_the_other_arrow_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station = Station()
    held = [(1.0 + 0.03 * n, ["up"]) for n in (0, 17, 18, 19, 20, 21)]
    press(monkeypatch, station, [(0.0, ["i"]), *held, (1.7, ["down"]), (2.6, ["down"])])
    assert steps(station) == [("wind_in", 0.001), ("pay_out", 0.001), ("pay_out", 0.001)]


@pytest.mark.parametrize("phase", ["enabling", "moving", "running down", "stopping"])
def test_a_tap_before_the_last_step_has_ended_is_ignored_and_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], phase: str
) -> None:
    station = Station()
    station.shown = standing(phase)
    press(monkeypatch, station, [(0.0, ["i"]), (1.0, ["up"])])
    assert steps(station) == []
    assert f"winch A is still {phase}; this tap was ignored" in capsys.readouterr().err
