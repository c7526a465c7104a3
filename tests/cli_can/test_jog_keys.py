"""The keyboard of ``jog``: what each key, held, let go or pressed once, asks of the station."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from winchkit.cli import jog
from winchkit.errors import ConnectionLost, NotPermitted

STATUS = {
    "winch": {
        "A": {
            "cable_length": 4.0,
            "speed": None,
            "rope_tension": 98.1,
            "length": None,
            "phase": "disabled",
        }
    }
}


class Station:
    """Writes down what it is asked; may refuse to jog."""

    def __init__(self, refusal: Exception | None = None) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self._refusal = refusal

    def jog(self, winch: str | None, speed: float, hold: float) -> None:
        self.calls.append(("jog", round(speed, 6), hold))
        if self._refusal is not None:
            raise self._refusal

    def stop(self) -> None:
        self.calls.append(("stop",))

    def reset(self) -> None:
        self.calls.append(("reset",))

    def status(self) -> dict[str, Any]:
        return STATUS


def press(
    monkeypatch: pytest.MonkeyPatch, station: Station, keys: list[tuple[float, list[str]]]
) -> None:
    """Let keys come at times (s), then leave."""
    now = [0.0]

    class Keyboard:
        def __init__(self) -> None:
            self._left = iter([*keys, (now[0], ["q"])])

        def read(self, timeout: float) -> list[str]:
            now[0], pressed = next(self._left)
            return pressed

    @contextmanager
    def open_keys() -> Iterator[Keyboard]:
        yield Keyboard()

    monkeypatch.setattr("winchkit.cli.keys.open_keys", open_keys)
    monkeypatch.setattr(jog, "time", SimpleNamespace(monotonic=lambda: now[0]))
    jog._jog_by_keys(station, "A", 0.1)  # type: ignore[arg-type]


def test_a_first_press_lasts_and_repeats_refresh_shortly(monkeypatch: pytest.MonkeyPatch) -> None:
    station = Station()
    press(monkeypatch, station, [(0.0, ["up"]), (0.5, ["up"]), (0.53, ["up"]), (2.0, ["up"])])
    holds = [call[2] for call in station.calls if call[0] == "jog"]
    assert holds == [0.7, 0.2, 0.2, 0.7]
    assert station.calls[-1] == ("stop",), "q stops"


def test_arrows_give_the_direction_and_plus_and_minus_the_speed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    station = Station()
    press(monkeypatch, station, [(0.0, ["up"]), (0.1, ["+", "down"]), (0.2, ["-", "-", "up"])])
    assert [call[1] for call in station.calls if call[0] == "jog"] == [0.1, -0.125, 0.08]


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


def test_a_lost_owner_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConnectionLost):
        press(monkeypatch, Station(ConnectionLost("gone")), [(0.0, ["up"])])
