"""Recordings of a known motion in files whose structure is changed at random.

One axis, rotary or linear, moves by a sum of sines; its file differs in names, units, signs, order
of columns and rows, encoding, separators, clock, wraps, lost signs, cuts and joins, by a seed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_TURN = 2 * math.pi
_DEG = _TURN / 360
_RATED = 2.4
_COUNTS = 4096
_NAMES = {
    "motor_angle": ("Position", "Motor angle", "ActPos", "theta", "Winkel", "encoder", "q_m"),
    "motor_velocity": ("Velocity", "speed", "ActVel", "omega", "Drehzahl", "omega_m"),
    "motor_torque": ("Torque", "Drehmoment", "tau", "ActTorque", "couple", "tau_m"),
    "position": ("Position", "Displacement", "Weg", "stroke", "pos"),
    "velocity": ("Velocity", "speed", "Geschwindigkeit"),
    "force": ("Force", "Kraft", "Axial Force"),
}
_UNITS: dict[str, dict[str, float]] = {
    "motor_angle": {"rad": 1.0, "deg": _DEG, "°": _DEG, "rev": _TURN, "counts": _TURN / _COUNTS},
    "motor_velocity": {"rad/s": 1.0, "rpm": _TURN / 60, "deg/s": _DEG, "1/min": _TURN / 60},
    "motor_torque": {"Nm": 1.0, "mNm": 1e-3, "%": _RATED / 100, "lbf in": 4.4482216152605 * 0.0254},
    "position": {"m": 1.0, "mm": 1e-3, "in": 0.0254},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3},
    "force": {"N": 1.0, "kN": 1e3, "kip": 4448.2216152605, "lbf": 4.4482216152605},
}  # fmt: skip
_CLOCKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
_ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "cp1252")
_FORMS = (*["text"] * 6, "jsonl", "json", "xlsx", "mat", "npz", "mcap")
"""Formats, those of text as often as all others together."""
_UNITLESS = {"mat", "npz", "mcap"}
"""Formats whose names have no units: the user gives them."""
_START = datetime(2025, 3, 4, 11, 59, 50, tzinfo=UTC)


@dataclass
class Recording:
    """A file with the truth that the test knows of it."""

    paths: tuple[Path, ...]
    options: tuple[str, ...]
    """Of ``winchkit import``: what the file does not say."""
    time: Array
    """Of the rows as they were sampled, s."""
    truth: dict[str, Callable[[Array], Array]]
    """Channel over time, SI."""
    resolution: dict[str, float]
    """Of each channel as written, SI."""
    clock: float
    """Resolution of the stamps, s."""
    names: dict[str, str]
    """Column of each channel."""
    moduli: dict[str, float] = field(default_factory=dict)
    """Range of a channel that wraps, SI: its number of turns at the start is not known."""
    changes: tuple[str, ...] = ()
    """What was changed, in words."""


def _key(name: str) -> str:
    """A name as a variable of a program."""
    return name.replace(" ", "_")


def recording(seed: int, folder: Path) -> Recording:
    """The file of a seed."""
    return _Writer(np.random.default_rng(seed), folder / f"log{seed}").write()


class _Writer:
    def __init__(self, rng: np.random.Generator, stem: Path) -> None:
        self.rng, self.stem, self.changes = rng, stem, list[str]()
        self.linear = bool(rng.random() < 0.25)
        names = ("position", "velocity", "force") if self.linear else (
            "motor_angle", "motor_velocity", "motor_torque"
        )  # fmt: skip
        size = 0.2 if self.linear else float(10 ** rng.uniform(0.3, 2.2))
        rates = np.sort(rng.uniform(0.3, 4.0, 3))
        sizes = size * rng.uniform(0.3, 1.0, 3) / rates
        phases = rng.uniform(0, _TURN, 3)
        load = 200.0 if self.linear else 1.2

        def angle(t: Array) -> Array:
            return np.asarray(np.sin(np.outer(t, rates) + phases) @ sizes)

        def rate(t: Array) -> Array:
            return np.asarray(np.cos(np.outer(t, rates) + phases) @ (sizes * rates))

        def torque(t: Array) -> Array:
            return np.asarray(load * (0.3 * rate(t) / size + 0.4 * np.tanh(20 * rate(t) / size)))

        self.truth = dict(zip(names, (angle, rate, torque), strict=True))
        if rng.random() < 0.25:
            del self.truth[names[1]]
        count = int(rng.integers(300, 900))
        self.period = float(rng.choice([0.002, 0.005, 0.01, 0.02]))
        self.time = np.arange(count) * self.period
        self.moduli: dict[str, float] = {}
        self.resolution: dict[str, float] = {}
        self.names: dict[str, str] = {}
        self.options: list[str] = []
        self.reversed: set[str] = set()
        self.form = self.pick(list(_FORMS))

    def chance(self, share: float, words: str) -> bool:
        """Whether a change is made; it is noted then."""
        made = bool(self.rng.random() < share)
        if made:
            self.changes.append(words)
        return made

    def pick(self, items: Sequence[str]) -> str:
        return str(items[int(self.rng.integers(len(items)))])

    def write(self) -> Recording:
        """Columns, then the order of the rows, then the file, or two files of one clock."""
        stamps, clock = self._stamps()
        columns = [("Time" if self.rng.random() < 0.5 else "t", clock, stamps)]
        columns += [
            (self.names[name], *self._column(name)) for name in map(self._named, self.truth)
        ]
        rows = self._rows()
        order = [0, *range(1, len(columns))]
        if self.chance(0.4, "order of columns"):
            order = list(map(int, self.rng.permutation(len(columns))))
        parts = [order]
        if self.chance(0.1, "two files"):
            at = list(self.truth).index(list(self.truth)[-1]) + 1
            parts = [[i for i in order if i != at], [i for i in order if i in {0, at}]]
            self.options += ["--join", "--lag", "0 s"]
        if self.chance(0.3, "a column more"):
            states = [str(int(self.rng.integers(3))) for _ in stamps]
            columns.append(("Status word", "", states))
            parts[0].append(len(columns) - 1)
        paths = [
            self._file(
                self.stem.with_name(f"{self.stem.name}{'ab'[number]}"),
                [columns[i][:2] for i in part],
                [[columns[i][2][r] for i in part] for r in rows],
            )
            for number, part in enumerate(parts)
        ]
        for channel, name in self.names.items():
            unit = next(unit for own, unit, _ in columns if own == name)
            sign = "-" * (channel in self.reversed)
            if self.form in _UNITLESS:
                self.options += ["--column", f"{channel}={sign}{_key(name)} [{unit}]"]
            elif sign:
                self.options += ["--column", f"{channel}=-{name}"]
        return Recording(
            tuple(paths),
            tuple(self.options),
            self.time,
            self.truth,
            self.resolution,
            self.clock,
            self.names,
            self.moduli,
            tuple(self.changes),
        )

    def _named(self, channel: str) -> str:
        """The channel, after its column has a name."""
        self.names[channel] = self.pick(_NAMES[channel])
        return channel

    def _column(self, channel: str) -> tuple[str, list[str]]:
        """Unit and cells of a channel."""
        unit = self.pick(list(_UNITS[channel]))
        si, decimals = _UNITS[channel][unit], int(self.rng.integers(2, 6))
        values = self.truth[channel](self.time) / si
        if unit == "counts":
            decimals = 0
            self.options += ["--counts-per-turn", str(_COUNTS)]
        elif unit == "%":
            self.options += ["--rated-torque", f"{_RATED} N m"]
        # Numbers as a recorder writes them: at least some hundred steps over the range.
        decimals = max(decimals, 3 - math.floor(math.log10(float(np.ptp(values)))))
        decimals = 0 if unit == "counts" else decimals
        sign = 1.0
        if self.chance(0.15, f"sign of {channel}"):
            sign = -1.0
            self.reversed.add(channel)
        values = np.round(sign * values, decimals)
        self.resolution[channel] = 10.0**-decimals * si
        base = channel.rpartition("_")[2]
        if base == "angle" and self.chance(0.2, "wrapped angle"):
            modulus = {"rad": _TURN, "rev": 1.0, "counts": 65536.0}.get(unit, 360.0)
            values = np.round(np.mod(values, modulus), decimals)
            self.moduli[channel] = modulus * si
        elif base in {"torque", "velocity"} and self.chance(0.1, f"lost sign of {channel}"):
            scale = 10.0**decimals
            # Numbers that are all negative say nothing of a lost sign.
            is_both = bool(np.any(values < 0) and np.any(values > 0))
            if is_both and float(np.max(np.abs(values))) * scale < 32000:
                values = np.where(values < 0, values + 65536 / scale, values)
        return unit, [f"{value:.{decimals}f}" for value in values]

    def _stamps(self) -> tuple[list[str], str]:
        """Stamps as text, and the unit of their header."""
        time = self.time
        if self.chance(0.3, "jitter of the clock"):
            time = time + self.rng.uniform(-0.2, 0.2, len(time)) * self.period
            self.time = time
        kinds = ("s", "ms", "us", "iso", "epoch")
        kind = self.pick(kinds[:3] if self.form in _UNITLESS else kinds)
        self.clock = 1e-6
        start = float(self.rng.choice([0.0, 12.5, 4711.0]))
        if kind == "iso":
            self.changes.append("ISO stamps")
            moments = [_START + timedelta(seconds=float(t)) for t in time]
            return [moment.strftime("%Y-%m-%d %H:%M:%S.%f") for moment in moments], ""
        if kind == "epoch":
            self.changes.append("seconds since 1970")
            return [f"{_START.timestamp() + float(t):.6f}" for t in time], "s"
        decimals = {"s": 6, "ms": 3, "us": 0}[kind]
        return [f"{(start + float(t)) / _CLOCKS[kind]:.{decimals}f}" for t in time], kind

    def _rows(self) -> list[int]:
        """Rows in the order of the file."""
        rows = list(range(len(self.time)))
        count = len(rows)
        if self.chance(0.05, "latest row first"):
            return rows[::-1]
        if self.chance(0.1, "one row out of order"):
            at, to = (int(i) for i in self.rng.integers(10, count - 10, 2))
            rows.insert(to, rows.pop(at))
        if self.chance(0.04, "rows shuffled"):
            return list(map(int, self.rng.permutation(count)))
        if self.chance(0.1, "a row twice"):
            at = int(self.rng.integers(5, count - 5))
            rows.insert(at, rows[at])
        if self.chance(0.12, "rows lost"):
            at, gap = int(self.rng.integers(50, count - 90)), int(self.rng.integers(1, 60))
            del rows[at : at + gap]
        if self.chance(0.04, "a stretch again"):
            at = int(self.rng.integers(50, count - 90))
            rows = rows[: at + 40] + rows[at:]
        return rows

    def _file(self, stem: Path, columns: Sequence[tuple[str, str]], cells: list[list[str]]) -> Path:
        """A file of columns, each with its name and its unit."""
        self.changes.append(self.form)
        heads = [f"{name} [{unit}]" if unit else name for name, unit in columns]
        if self.form == "text":
            return self._text(stem.with_suffix(".csv"), heads, cells)
        numbers = [[c if ":" in c else float(c) for c in row] for row in cells]
        if self.form in {"jsonl", "json"}:
            return self._json(stem, heads, numbers)
        path = stem.with_suffix(f".{self.form}")
        if self.form == "xlsx":
            from openpyxl import Workbook

            book = Workbook()
            for row in (heads, *numbers):
                book.worksheets[0].append(row)
            book.save(path)
            return path
        if self.form == "mcap":
            return self._messages(path, columns, np.array(numbers))
        time = columns.index(next(c for c in columns if c[0] in {"Time", "t"}))
        keys = [f"t_{unit}" if i == time else _key(name) for i, (name, unit) in enumerate(columns)]
        arrays = dict(zip(keys, np.array(numbers).T, strict=True))
        if self.form == "mat":
            from scipy.io import savemat

            savemat(path, arrays)
        else:
            np.savez(path, **arrays)
        return path

    def _json(self, stem: Path, heads: list[str], numbers: Sequence[Sequence[str | float]]) -> Path:
        rows = [dict(zip(heads, row, strict=True)) for row in numbers]
        path = stem.with_suffix(f".{self.form}")
        if self.form == "jsonl":
            path.write_text("\n".join(map(json.dumps, rows)) + "\n")
        else:
            path.write_text(json.dumps({h: [row[h] for row in rows] for h in heads}))
        return path

    def _messages(self, path: Path, columns: Sequence[tuple[str, str]], numbers: Array) -> Path:
        """Messages in JSON, some with the stamp of their source, logged up to 3 ms later."""
        from mcap.writer import Writer

        is_stamped = self.chance(0.5, "stamps of the source")
        at = next(i for i, (name, _) in enumerate(columns) if name in {"Time", "t"})
        zero = round(_START.timestamp() * 1e9)
        with open(path, "wb") as stream:
            writer = Writer(stream)
            writer.start()
            topic = writer.register_channel("/axis", "json", 0)
            for row in numbers:
                stamp = zero + round(row[at] * _CLOCKS[columns[at][1]] * 1e9)
                later = int(self.rng.integers(3_000_000)) if is_stamped else 0
                message: dict[str, object] = {
                    _key(name): value
                    for i, ((name, _), value) in enumerate(zip(columns, row, strict=True))
                    if i != at
                }
                if is_stamped:
                    sec, nanosec = divmod(stamp, 1_000_000_000)
                    message["header"] = {"stamp": {"sec": sec, "nanosec": nanosec}}
                data = json.dumps(message).encode()
                writer.add_message(topic, stamp + later, data, stamp + later)
            writer.finish()
        return path

    def _heads(self, heads: list[str]) -> list[list[str]]:
        """Rows of the header, with the units where recorders write them."""
        parts = [(name, unit.rstrip("]")) for name, _, unit in (h.partition(" [") for h in heads)]
        if all(unit for _, unit in parts) and self.chance(0.15, "units in a row of their own"):
            return [[name for name, _ in parts], [f"({unit})" for _, unit in parts]]
        if self.chance(0.15, "units in parentheses"):
            return [[f"{name} ({unit})" if unit else name for name, unit in parts]]
        plain = all(unit.isalnum() or not unit for _, unit in parts)
        if plain and self.chance(0.15, "units behind the names"):
            return [[f"{_key(name)}_{unit}" if unit else _key(name) for name, unit in parts]]
        return [heads]

    def _spoiled(self, heads: list[str], cells: list[list[str]]) -> None:
        """Cells in exponents, missing cells, and set points beside the measured columns."""
        # Stamps of many digits would lose some, and rows without a stamp are refused.
        places = [at for at, head in enumerate(heads) if head.split(" [")[0] not in {"Time", "t"}]
        if self.chance(0.1, "exponents"):
            for row, at in product(cells, places):
                row[at] = f"{float(row[at]):.12e}"
        if self.chance(0.1, "missing cells"):
            text = self.pick(("", "NaN", "-", "n/a"))
            for row, at in product(cells, places):
                row[at] = text if self.rng.random() < 0.01 else row[at]
        if self.chance(0.15, "set points"):
            at = int(self.rng.integers(1, len(heads)))
            name, _, unit = heads[at].partition(" [")
            if name not in {"Time", "t"}:
                word = self.pick(("setpoint", "target", "Soll", "cmd"))
                heads.append(f"{name} {word}" + f" [{unit}" * bool(unit))
                for now, later in zip(cells, [*cells[7:], *cells[:7]], strict=True):
                    now.append(later[at])

    def _text(self, path: Path, heads: list[str], cells: list[list[str]]) -> Path:
        self._spoiled(heads, cells)
        mark = self.pick((",", ";", "\t", "|"))
        comma = mark != "," and self.chance(0.4, "decimal comma")
        if comma:
            cells = [[c if ":" in c else c.replace(".", ",") for c in row] for row in cells]
        rows = [*self._heads(heads), *cells]
        if self.chance(0.1, "quotes"):
            rows = [[f'"{cell}"' for cell in row] for row in rows]
        end = mark * self.chance(0.08, "a separator behind each row")
        head, *_ = lines = [mark.join(row) + end for row in rows]
        if self.chance(0.2, "lines above the header"):
            lines = ["Recorder 7", f"Exported{mark}yes", *lines]
        if self.chance(0.05, "a summary below the rows"):
            lines += [mark.join(["Mean", *cells[0][1:]]), mark.join(["Max", *cells[-1][1:]])]
        elif not comma and self.chance(0.05, "a name before each value"):
            named = [[f"{h}:{c}" for h, c in zip(heads, row, strict=True)] for row in cells]
            lines = ["Boot of recorder 7", *(mark.join(row) for row in named)]
        # The part that is left may have negative numbers only, which do not show a lost sign.
        is_lost = any(change.startswith("lost sign") for change in self.changes)
        if not is_lost and self.chance(0.08, "cut off"):
            kept = int(self.rng.integers(len(lines) // 3, len(lines)))
            last = lines[kept - 1]
            lines = [*lines[: kept - 1], last[: int(self.rng.integers(1, len(last) + 1))]]
            ending = ""
        else:
            ending = "\n"
        if self.chance(0.03, "header again"):
            at = int(self.rng.integers(100, len(lines)))
            lines.insert(at, head)
        ends = self.pick(("\n", "\r\n"))
        encoding = self.pick(_ENCODINGS)
        self.changes.append(f"{encoding}, {mark!r}")
        path.write_bytes((ends.join(lines) + ending).encode(encoding))
        return path
