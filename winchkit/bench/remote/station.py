"""Operations on a bench, the same in the owner's process and from outside it."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict
from typing import Any

from winchkit.bench.bench import Bench
from winchkit.bench.cells.tasks import do
from winchkit.bench.control.dead_man import DEAD_MAN, LIFE_SIGN, DeadMan, remaining
from winchkit.bench.control.homing_motion import HomingRequest
from winchkit.bench.control.snapshot import to_dict
from winchkit.bench.direction import no_positional, paid_out
from winchkit.bench.recording.recorder import OwnedLog, counters_of
from winchkit.bench.remote.identity import Client, client_name
from winchkit.bench.remote.operations import Station
from winchkit.bench.remote.programme_run import ProgrammeRun
from winchkit.bench.winch import Winch
from winchkit.drivers.can.bus.frame_tap import SeenFrame
from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.errors import MotionError, UsageError
from winchkit.schema.programme import ALL


class LocalStation(OwnedLog, Station):
    """A station in the process that owns the bench."""

    def __init__(self, bench: Bench, client: Client | None = None) -> None:
        """A place for ``client``; without one for an unnamed station of this process."""
        self.client = client or Client(client_name("station"))
        self._bench = bench
        self._homing: Generator[None] | None = None
        self._led = DeadMan(float("-inf"))
        """Permission of the homing to go on to its next motion."""
        self._programme: ProgrammeRun | None = None

    @property
    def clock(self) -> Clock:
        return self._bench.clock

    def names(self) -> list[str]:
        return list(self._bench.winch)

    def status(self) -> dict[str, Any]:
        buses = {name: asdict(item) for name, item in self._bench.bus_health.items()}
        for item in buses.values():
            item["state"] = item["state"].value
        return {
            **to_dict(self._bench.snapshot),
            "cycle_time": {
                "period": self._bench.loop.cycle,
                "counts": list(self._bench.loop.cycle_counts),
            },
            "bus": buses,
            "tare": {
                name: _tare(winch.sensors["cell"])
                for name, winch in self._bench.winch.items()
                if "cell" in winch.sensors
            },
            "realtime": [asdict(item) for item in self._bench.realtime.items],
            "not_commissioned": self._bench.not_commissioned,
            "owner": self._bench.commanders.owner.name,
            "clients": [client.name for client in self._bench.stations.clients],
        }

    def jog(
        self,
        winch: str | None,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        hold: float = DEAD_MAN,
        since: float | None = None,
    ) -> None:
        hold = hold if since is None else remaining(hold, self.clock.now() - since)
        with self._acting():
            self._bench.named(winch).jog(*unnamed, pay_out=pay_out, wind_in=wind_in, hold=hold)

    def refresh(
        self,
        winch: str | None,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        hold: float = DEAD_MAN,
    ) -> None:
        with self._acting():
            for item in self._chosen(winch):
                item.refresh(*unnamed, pay_out=pay_out, wind_in=wind_in, hold=hold)

    def release(self, winch: str | None) -> None:
        with self._acting():
            for item in self._chosen(winch):
                item.release()

    def step(
        self,
        winch: str | None,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        speed: float | None = None,
        since: float | None = None,
    ) -> None:
        no_positional("step", "m", unnamed)
        if since is not None:
            remaining(LIFE_SIGN, self.clock.now() - since)
        change = paid_out("step", pay_out, wind_in)
        chosen = self._bench.named(winch)
        with self._acting():
            chosen.move_to(chosen.cable_length + change, speed, wait=False)

    def move(
        self,
        winch: str | None,
        *unnamed: object,
        to: float | None = None,
        pay_out: float | None = None,
        wind_in: float | None = None,
        speed: float | None = None,
        acceleration: float | None = None,
    ) -> None:
        no_positional("move", "m", unnamed)
        if (to is None) == (pay_out is None and wind_in is None):
            raise UsageError(
                "a move goes either to a cable length or by a change of it; give to=, pay_out= or "
                "wind_in="
            )
        change = paid_out("move", pay_out, wind_in) if to is None else 0.0
        lengths = {
            item.name: item.cable_length + change if to is None else to
            for item in self._chosen(winch)
        }
        with self._acting():
            self._bench.move_together(lengths, speed, acceleration, wait=False)

    def move_pose(
        self,
        change: Mapping[str, float],
        relative: bool,
        speed: float | None = None,
        acceleration: float | None = None,
    ) -> None:
        platform = self._bench.robot
        goal = platform.moved(change, relative=relative)
        with self._acting():
            platform.move(goal, speed, acceleration, wait=False)

    def pose(self) -> dict[str, float]:
        return self._bench.robot.coordinates()

    def hold_tension(
        self, winch: str | None, tension: float, hold: float, bounds: Mapping[str, float]
    ) -> None:
        with self._acting():
            self._bench.named(winch).hold_tension(tension, hold=hold, **bounds)

    def hold_platform(
        self,
        preload: float | Mapping[str, float] | None,
        pose: Mapping[str, float] | None,
        hold: float,
        bounds: Mapping[str, float],
    ) -> None:
        platform = self._bench.robot
        goal = None if pose is None else platform.moved(pose, relative=False)
        with self._acting():
            platform.hold(preload=preload, pose=goal, hold=hold, **bounds)

    def platform_held(self) -> dict[str, Any]:
        return self._bench.robot.held()

    def take_over(self, winch: str | None) -> None:
        with self._acting():
            for item in self._chosen(winch):
                self._bench.commanders.take_over(item.name)

    def moving(self, winch: str | None) -> bool:
        chosen = self._chosen(winch)
        with self._acting():
            for item in chosen:
                self._bench.commanders.raise_taken(item.name)
            if any(item.moving for item in chosen):
                return True
            for item in chosen:
                item.wait()
        return False

    def home(
        self, winch: str | None, method: int | None, at: float | None, speed: float | None
    ) -> None:
        asked = HomingRequest(method, at, speed)
        with self._acting():
            self._homing = self._bench.homing(self._bench.named(winch).name, asked)
            next(self._homing, None)
        self._led = DeadMan(self.clock.now() + LIFE_SIGN)

    def homing(self) -> bool:
        if self._homing is None:
            return False
        with self._acting():
            try:
                self._led.refresh(now := self.clock.now(), now + LIFE_SIGN)
            except MotionError:
                homing, self._homing = self._homing, None
                homing.close()
                raise
            for _ in self._homing:
                # It may have waited for the drive.
                self._led = DeadMan(self.clock.now() + LIFE_SIGN)
                return True
        self._homing = None
        return False

    def stop(self) -> None:
        with self._acting():
            self._bench.stop_now()

    def reset(self) -> list[str]:
        with self._acting():
            return self._bench.reset()

    def tare(self, winch: str | None) -> float:
        return self._bench.named(winch).tare()

    def start_log(self, path: str, rotate: str | None = None, replace: bool = False) -> None:
        self.end_log()
        self._recorder = self._bench.log(path, rotate=rotate, replace=replace)

    def read_object(self, winch: str | None, index: int, sub: int) -> str | None:
        name = self._bench.named(winch).name
        data = self._bench.axes[name].objects.upload_if_there(index, sub)
        return None if data is None else data.hex()

    def scanned(self) -> list[dict[str, Any]]:
        return [asdict(item) for item in self._bench.scan()]

    def counters(self) -> dict[str, dict[str, Any]]:
        if self._recorder is not None:
            return self._recorder.counters()
        return counters_of({name: winch.sensors for name, winch in self._bench.winch.items()})

    def trip_history(self) -> dict[str, Any] | None:
        return self._bench.trip_history.to_dict(self._bench.snapshot)

    def begin_no_more(self) -> None:
        """Let this station's programme begin no further motion: the bench is closed."""
        if self._programme is not None:
            self._programme.begin_no_more()

    def frames(self) -> dict[str, dict[str, Any]]:
        return {
            name: {
                "newest": [[count, *_frame(item)] for count, item in tap.newest],
                "last": [_frame(item) for item in tap.last],
            }
            for name, tap in self._bench.frames().items()
        }

    def start_programme(
        self, path: str, folder: str, suffix: str = ".csv", replace: bool = False
    ) -> None:
        if self._programme is not None and not self._programme.ended:
            raise UsageError("a programme of this client is under way; end it first")
        self._programme = ProgrammeRun(
            self._bench, self.client, path, folder, suffix, replace=replace
        )

    def programme(self) -> dict[str, Any] | None:
        return None if self._programme is None else self._programme.state()

    def answer_programme(self) -> None:
        if self._programme is None:
            raise UsageError("no programme is under way")
        self._programme.answer()

    def end_programme(self) -> None:
        if self._programme is not None:
            self._programme.end()

    def cell(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        return do(self._bench.cells, task, name, *arguments)

    def close(self) -> None:
        """Ramp down what this station set in motion, finish its log; returns at rest.

        With it stop the winches without commander, unless ``stop_together`` is false.
        """
        commanders = self._bench.commanders
        moved = [name for name in commanders.held_by(self.client) if self._bench.winch[name].moving]
        try:
            self.end_programme()
            with self._acting():
                if self._homing is not None:
                    self._homing.close()
                if moved:
                    self._bench.stop_commanded(moved)
        finally:
            commanders.leave(self.client)
            self.end_log()

    def _acting(self) -> AbstractContextManager[None]:
        """Orders within it are this station's client's."""
        return self._bench.commanders.acting(self.client)

    def _chosen(self, winch: str | None) -> list[Winch]:
        """One winch, or with "all" every one."""
        every = list(self._bench.winch.values())
        return every if winch == ALL else [self._bench.named(winch)]


def _tare(cell: Sensor) -> float | None:
    """Gross less net value, by the device and the host together, N; None without a measurement."""
    reading = cell.latest
    if reading is None or not reading.quality.usable:
        return None
    return reading.gross - reading.value


def _frame(frame: SeenFrame) -> list[Any]:
    """Time, identifier and bytes in hexadecimal."""
    return [round(frame.time, 4), frame.identifier, frame.data.hex()]
