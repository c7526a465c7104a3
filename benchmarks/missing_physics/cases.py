"""Cases: a machine, what is hidden in it, its runs, and the folder with what an entrant gets."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from missing_physics.effects import (
    ALL,
    CATALOGUE,
    FRICTIONS,
    MOST,
    OUTSIDE,
    Hidden,
    outputs,
    possible,
)
from missing_physics.loggers import LOGGERS, Table, instrument_noise
from missing_physics.machine import (
    EVERY,
    UNITS,
    Array,
    Machine,
    Motion,
    Random,
    draw_machine,
    draw_place,
    motion,
)

KINDS = ("tidy", "loggers", "friction", "once", "two", "outside")
SECONDS = 50.0
EASIEST, HARDEST = 12.0, 1.5
"""Size of a hidden effect in the output that shows it best: rms change over the noise."""
HELD_OUT = "held_out.csv"


@dataclass(frozen=True)
class Case:
    """A case with its truth; runs as recorded, by output and SI."""

    kind: str
    machine: Machine
    hidden: tuple[Hidden, ...]
    runs: list[Table]
    facts: list[dict[str, str]]
    """Metadata of each run."""
    held_out: Table
    """A run of another programme by perfect loggers, outputs with the noise of the instruments."""
    held_facts: dict[str, str]
    truth: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Instruments:
    """What all runs of a case have in common."""

    colour: float
    """Share of the noise's power that is coloured."""
    zero: float
    """Of the length counter, m."""
    warm: bool
    """Whether the temperature varies and is measured."""


def kinds(seed: int, cases: int) -> list[str]:
    """Kind of each case: all alike often, in an order that follows from the seed."""
    even = [KINDS[index % len(KINDS)] for index in range(cases)]
    return [str(kind) for kind in np.random.default_rng([seed, cases]).permutation(even)]


def draw_case(seed: int, index: int, kind: str) -> Case:
    """The case of a number."""
    random = np.random.default_rng([seed, index, 1])
    machine, masses = draw_machine(random, str(random.choice(["winch", "winch", "axis"])))
    warm = machine.kind == "winch" and random.random() < 0.4
    programmes = [draw_place(random, machine, SECONDS) for _ in range(3)]
    loads = masses[:2] * 2 if len(masses) > 1 else masses * 2
    ideal = []
    for number, mass in zip((0, 0, 1, 1) if len(masses) > 1 else (0, 1), loads, strict=True):
        ideal.append(motion(programmes[number], mass, _temperature(random, warm), number))
    last = motion(programmes[2], masses[-1], _temperature(random, warm), 2)
    hidden, snr = draw_hidden(random, kind, machine, ideal, warm)
    instruments = Instruments(
        float(random.choice([0.0, 0.0, 0.3])), float(random.normal(0, 0.02)), warm
    )

    def recorded(run: Motion) -> Table:
        return record(random, machine, run, hidden, instruments)

    runs = [run for run in ideal for _ in range(1 if kind == "once" else 2)]
    tables = [recorded(run) for run in runs]
    logger = ""
    if kind == "loggers":
        logger = str(random.choice(list(LOGGERS)))
        tables = LOGGERS[logger](random, machine, tables)
    truth: dict[str, object] = {
        "kind": kind,
        "logger": logger,
        "hidden": [asdict(one) | {"snr": round(s, 3)} for one, s in zip(hidden, snr, strict=True)],
        "right": [ALL[h.name].names or (h.name,) for h in hidden if h.name not in OUTSIDE],
        "tolerated": ["motor-stribeck", "pulley-stribeck"]
        if any(one.name.endswith("lugre") for one in hidden)
        else [],
        "outside": any(one.name in OUTSIDE for one in hidden),
    }
    return Case(
        kind, machine, hidden, tables, [facts(r) for r in runs], recorded(last), facts(last), truth
    )


def draw_hidden(
    random: Random, kind: str, machine: Machine, runs: list[Motion], warm: bool
) -> tuple[tuple[Hidden, ...], list[float]]:
    """Effects of a kind that the machine can have, of sizes that the runs show; their sizes."""
    count = {"two": 2, "outside": int(random.random() < 0.5)}.get(kind, 1)
    if kind in ("loggers", "once") and random.random() < 0.2:
        count = 0
    of = {"friction": FRICTIONS, "outside": OUTSIDE}.get(kind, CATALOGUE)
    names = [name for name, effect in of.items() if possible(effect, machine, warm)]
    hidden: list[Hidden] = []
    sizes: list[float] = []
    for name in random.permutation(names):
        if len(hidden) == count:
            break
        effect = ALL[str(name)]
        size = machine.noise["motor_torque"] if effect.size is None else effect.size
        one = Hidden(str(name), effect.drawn(random, runs[0]) | {"size": size})
        aim = float(np.exp(random.uniform(np.log(HARDEST), np.log(EASIEST))))
        for _ in range(2):  # nearly linear: the second time corrects
            scaled = one.parameters["size"] * aim / max(shown(machine, runs, one), 1e-9)
            if effect.size is not None:
                scaled = min(scaled, MOST * effect.size)
            one = Hidden(one.name, one.parameters | {"size": scaled})
        seen = shown(machine, runs, one)
        if seen > 0.9 * HARDEST:
            hidden.append(one)
            sizes.append(seen)
    return tuple(hidden), sizes


def shown(machine: Machine, runs: list[Motion], one: Hidden) -> float:
    """Rms change by an effect over the noise, in the output that shows it best.

    Of a length about its mean, since the counter's zero is unknown.
    """
    total = dict.fromkeys(machine.outputs, 0.0)
    for run in runs:
        with_it, without = outputs(machine, run, (one,)), outputs(machine, run)
        for name in total:
            change = with_it[name] - without[name]
            change = change - np.mean(change) if name == "cable_length" else change
            total[name] += float(np.mean(change**2)) / len(runs)
    return max(np.sqrt(total[name]) / machine.noise[name] for name in total)


def _temperature(random: Random, warm: bool) -> Array:
    """Of a run, °C."""
    turns = np.linspace(0, np.pi * random.uniform(0.8, 1.7), round(SECONDS * 200))
    return 20 + random.uniform(0, 4) + (random.uniform(3, 9) * np.sin(turns) if warm else 0 * turns)


def facts(run: Motion) -> dict[str, str]:
    """Metadata of a run."""
    load = {"load_mass": f"{run.mass} kg"} if run.mass else {}
    return {"programme": f"moves-{run.programme}"} | load


def record(
    random: Random,
    machine: Machine,
    run: Motion,
    hidden: tuple[Hidden, ...],
    instruments: Instruments,
) -> Table:
    """Samples of a run by perfect loggers, and what the declared machine would show there."""
    ideal, nominal = outputs(machine, run, hidden), outputs(machine, run)
    table = {"time": run.time[::EVERY], "motor_angle": run.angle[::EVERY]}
    count = len(table["time"])
    for name in machine.outputs:
        noise = instrument_noise(random, count, machine.noise[name], instruments.colour)
        offset = instruments.zero if name == "cable_length" else 0.0
        table[name] = ideal[name][::EVERY] + noise + offset
    if instruments.warm:
        table["temperature"] = run.temperature[::EVERY] + random.normal(0, 0.02, count)
    return table | {f"nominal_{name}": x[::EVERY] for name, x in nominal.items()}


def write_case(case: Case, folder: Path) -> None:
    """Write machine.json, the runs, and the held-out run without its outputs."""
    folder.mkdir(parents=True)
    names = [f"run-{index + 1}.csv" for index in range(len(case.runs))]
    for name, run, metadata in zip(names, case.runs, case.facts, strict=True):
        write_csv(run, metadata, folder / name)
    given = {k: x for k, x in case.held_out.items() if k not in case.machine.outputs}
    write_csv(given, case.held_facts, folder / HELD_OUT)
    known = {"machine": case.machine.declared(), "runs": names, "held_out": HELD_OUT}
    (folder / "machine.json").write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")


def write_truth(case: Case, path: Path) -> None:
    """Write what is hidden and the outputs of the held-out run."""
    machine, held = case.machine, case.held_out

    def digits(values: Array) -> list[float]:
        return [float(f"{x:.8g}") for x in values]

    truth = case.truth | {
        "noise": machine.noise,
        "held_out": {name: digits(held[name]) for name in machine.outputs},
        "nominal": {name: digits(held[f"nominal_{name}"]) for name in machine.outputs},
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(truth) + "\n", encoding="utf-8")


def write_csv(table: Table, metadata: dict[str, str], path: Path) -> None:
    """Lines of metadata, a header with units, rows."""
    head = [f"# {key}: {value}" for key, value in metadata.items()]
    head.append(",".join(f"{name} [{UNITS[name.removeprefix('nominal_')]}]" for name in table))
    with path.open("w", encoding="utf-8") as out:
        out.write("\n".join(head) + "\n")
        np.savetxt(out, np.column_stack(list(table.values())), fmt="%.9g", delimiter=",")
