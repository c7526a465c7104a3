"""Draws docs/pictures: ``python docs/make_pictures.py``, with matplotlib (extra ``plot``).

Pictures of recordings of others are drawn where WINCHKIT_EMPS and WINCHKIT_REAL name their folders,
and otherwise remain as they are.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from winchkit import (
    add,
    diagnose,
    find,
    load_catalogue,
    read_profile,
    read_programme,
    read_run,
    read_simbench,
    simulate,
)
from winchkit.effects.bind import line_of
from winchkit.effects.term import modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.report.figures.export import file_svg
from winchkit.report.pages.pages import report_figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from winchkit import Run

DOCS = Path(__file__).parent
PICTURES = DOCS / "pictures"
BEFORE, AFTER, MEASURED = "#b3403a", "#2c6fb0", "#8a8f96"
_STYLE = {
    "svg.hashsalt": "winchkit",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.figsize": (6.4, 2.8),
    "figure.constrained_layout.use": True,
    "legend.frameon": False,
}


def first_hour() -> Axes:
    """Error of the cable length of ``demo-thick-layers``, without and with the named effect."""
    bench = read_simbench(find("sim", "demo-thick-layers"))
    profile = read_profile(find("profiles", "bench-spiral"))
    programme = read_programme(find("sim", "programme-demo"))
    runs = list(simulate(bench, {"A": profile}, programme))
    terms = [term for term, _ in add("layer-thickness", runs, profile).terms]
    axes = _axes()
    run = runs[0]
    for line, color, label in (
        (line_of(profile), BEFORE, "profile bench-spiral"),
        (Line(profile, modifiers_of(terms)), AFTER, "with layer-thickness"),
    ):
        error = run["cable_length"] - _predicted(line, run, "cable_length")
        axes.plot(run.time, 1e3 * (error - error[0]), color=color, label=label, linewidth=1)
    axes.set(xlabel="time (s)", ylabel="error of the cable length (mm)")
    return axes


def figures() -> None:
    """Figures of the report of ``demo-eccentric-drum``, for the page about them."""
    bench = read_simbench(find("sim", "demo-eccentric-drum"))
    profile = read_profile(find("profiles", "bench-spiral"))
    names = ("programme-demo", "programme-demo-fast")
    programmes = [read_programme(find("sim", name)) for name in names]
    runs = [run for one in programmes for run in simulate(bench, {"A": profile}, one)]
    answer = diagnose(runs, profile)
    drawn = {one.id: one for one in report_figures(answer, "profile bench-spiral")}
    for name in ("errors", "time-cable_length", "over-cable_length", "map-cable_length-today"):
        picture = PICTURES / f"figure-{name.partition('-')[0]}.svg"
        picture.write_text(file_svg(drawn[name]) + "\n", encoding="utf-8")


def emps(folder: Path) -> Axes:
    """Force of EMPS: measured, and predicted with and without Coulomb friction."""
    run = read_run(folder / "train.csv")
    (block,) = re.findall(r'title="emps.toml"\n(.*?)```', _page("emps"), re.DOTALL)
    profile = read_profile(_saved(block))
    terms = [term for term, _ in add("motor-coulomb", [run], profile).terms]
    axes = _axes()
    part = slice(0, 6000, 10)
    axes.plot(run.time[part], run["motor_torque"][part], color=MEASURED, label="measured", lw=2.5)
    for line, color, label in (
        (line_of(profile), BEFORE, "mass and viscous friction"),
        (Line(profile, modifiers_of(terms)), AFTER, "with motor-coulomb"),
    ):
        predicted = _predicted(line, run, "motor_torque")
        axes.plot(run.time[part], predicted[part], color=color, label=label, linewidth=1)
    axes.set(xlabel="time (s)", ylabel="motor force (N)")
    return axes


def cogging(folder: Path) -> Axes:
    """A map of the ODrive motor's torque, and the table fitted to two other maps."""
    (source,) = re.findall(r'title="cogging.py"\n(.*?)```', _page("cogging"), re.DOTALL)
    (block,) = re.findall(r'title="motor.toml"\n(.*?)```', _page("cogging"), re.DOTALL)
    maps = {name: read_run(folder / "odrive-cogging" / f"map-{name}_16.csv") for name in "abd"}
    profile = read_profile(_saved(block))
    catalogue = load_catalogue([_saved(source, "cogging.py")])
    addition = add("cogging-table", [maps["a"], maps["b"]], profile, catalogue)
    line = Line(profile, modifiers_of([term for term, _ in addition.terms]))
    run = maps["d"]
    axes = _axes()
    angle, torque = np.degrees(run["motor_angle"]), run["motor_torque"]
    axes.plot(angle, 1e3 * (torque - torque.mean()), ".", color=MEASURED, label="map D", ms=3)
    predicted = _predicted(line, run, "motor_torque")
    axes.plot(angle, 1e3 * predicted, color=AFTER, label="table, fitted to A and B", linewidth=1)
    axes.set(xlabel="motor angle (°)", ylabel="torque (mN m)", xlim=(0, 360))
    return axes


def _page(name: str) -> str:
    return (DOCS / "tutorial" / f"{name}.md").read_text(encoding="utf-8")


def _saved(text: str, name: str = "profile.toml") -> Path:
    path = Path(_FOLDER.name) / name
    path.write_text(text, encoding="utf-8")
    return path


def _predicted(line: Line, run: Run, output: str) -> NDArray[np.float64]:
    tension = run["tension"] if "tension" in run else None  # noqa: SIM401 (a Run has no get)
    signals = Signals(run.time, run["motor_angle"], load_mass=run.load_mass, tension=tension)
    return np.asarray(line.predict(line.motion(signals))[output])


def _axes() -> Axes:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots()
    return axes


def _save(name: str, axes: Axes) -> None:
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.18), ncols=3)
    axes.grid(visible=True, color="#e4e6ea", linewidth=0.6)
    axes.set_axisbelow(True)
    figure = axes.get_figure()
    assert figure is not None
    PICTURES.mkdir(exist_ok=True)
    figure.savefig(PICTURES / f"{name}.svg", metadata={"Date": None, "Creator": None})
    sys.stdout.write(f"{PICTURES / name}.svg\n")


def main() -> None:
    """Draw what can be drawn."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams.update(_STYLE)
    figures()
    _save("first-hour", first_hour())
    if folder := os.environ.get("WINCHKIT_EMPS"):
        _save("emps", emps(Path(folder)))
    if folder := os.environ.get("WINCHKIT_REAL"):
        _save("cogging", cogging(Path(folder)))


_FOLDER = TemporaryDirectory()

if __name__ == "__main__":
    main()
