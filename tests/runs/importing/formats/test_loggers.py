"""Files as recorders, laboratories and serial lines write them: traits made from scratch."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from winchkit.arrays import Array
from winchkit.errors import RunError
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.session import import_runs
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.run import Run

TIME = np.arange(200) * 0.01
ANGLE = 3 * np.sin(math.pi * TIME) + 0.7 * TIME
TORQUE = 0.4 * np.cos(math.pi * TIME)
DEG = np.degrees(ANGLE)


def comma(value: float) -> str:
    return f"{value:.6f}".replace(".", ",")


def imported(path: Path) -> Run:
    (found,) = import_runs(path)
    return found


def right(run: Run, torque: Array = TORQUE) -> None:
    assert run.time == pytest.approx(TIME, abs=1e-9)
    assert run["motor_angle"] == pytest.approx(ANGLE, abs=1e-5)
    assert run["motor_torque"] == pytest.approx(torque, abs=1e-5, nan_ok=True)


def labview(path: Path, columns: str) -> None:
    """A file with one comment; ``columns``: No, One or Multi columns of times."""
    several = columns == "Multi"
    gap = "\t\t" if several else "\t"
    mark = "***End_of_Header***"
    lines = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t,"]
    lines += [f"X_Columns\t{columns}", "Time_Pref\tRelative", mark, ""]
    lines += [f"Channels\t2{gap}", f"Samples\t200{gap}200", f"Y_Unit_Label\tDeg{gap}mNm"]
    lines += [f"X_Dimension\tTime{gap}Time", f"X0\t0,0{gap}0,0", f"Delta_X\t0,01{gap}0,01", mark]
    lines.append("\t".join(["X_Value", "Encoder", *["X_Value"] * several, "Torque", "Comment"]))
    for k, time in enumerate(TIME):
        stamp = "" if columns == "No" else comma(time)
        cells = [stamp, comma(DEG[k]), *([stamp] if several else []), comma(1e3 * TORQUE[k])]
        lines.append("\t".join([*cells, *(["start"] if k == 0 else [])]))
    path.write_text("\r\n".join(lines) + "\r\n")


@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
def test_labview_has_a_unit_for_each_channel_and_comments_in_some_rows(
    columns: str, tmp_path: Path
) -> None:
    labview(tmp_path / "log.lvm", columns)
    right(imported(tmp_path / "log.lvm"))


def test_rows_with_a_title_belong_to_the_header_of_a_scope(tmp_path: Path) -> None:
    """TwinCAT Scope: other versions have other rows."""
    names = ("ActPos", "ActTorque")
    head = ["Name;" + ";".join(f"{n};{n}" for n in names), "Data-Type;" + ";REAL64" * 4]
    head += ["SampleTime[ms]" + ";10" * 4, "Unit;ms;deg;ms;Nm", "Unit Scale" + ";1" * 4]
    head += ["Line Width" + ";1" * 4, ""]
    rows = [
        f";{comma(1e3 * t)};{comma(x)};{comma(1e3 * t)};{comma(m)}"
        for t, x, m in zip(TIME, DEG, TORQUE, strict=True)
    ]
    path = tmp_path / "scope.csv"
    path.write_text("\n".join([*head, *rows, "EOF"]) + "\n")
    right(imported(path))


def signals(kind: str) -> dict[str, object]:
    """Variables of a MAT file: a scope of Simulink, a recording of dSPACE, cells."""
    if kind == "cells":
        cells = np.empty((1, 3), dtype=object)
        cells[0, :] = [TIME, ANGLE, TORQUE]
        return {"log": cells}
    values, label = ("values", "label") if kind == "scope" else ("Data", "Name")
    units = [] if kind == "scope" else [("Unit", object)]
    found = np.zeros(2, dtype=[(values, object), (label, object), *units])
    angle = (ANGLE[:, None], "theta") if kind == "scope" else (DEG[None, :], "theta", "deg")
    found[0], found[1] = angle, (TORQUE[:, None], "tau", *["N m"] * len(units))
    return {"rec": {"time": TIME[:, None], "signals": found}}


@pytest.mark.parametrize("kind", ["scope", "dspace"])
def test_signals_of_an_array_of_structures_have_their_names(kind: str, tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", signals(kind))
    right(imported(tmp_path / "log.mat"))


def test_cells_of_arrays_are_columns(tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", signals("cells"))
    given = ["time=log[0] [s]", "motor_angle=log[1] [rad]", "motor_torque=log[2] [N m]"]
    (run,) = import_runs(tmp_path / "log.mat", columns=given)
    right(run)


def mat73(path: Path, others: Path) -> None:
    """An array of structures as MATLAB writes it: references in each field; a link to a file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(others, "w") as other:
        other["secret"] = TIME
    with h5py.File(path, "w", userblock_size=512) as file:

        def stored(group: object, name: str, values: object, kind: str = "double") -> object:
            item = group.create_dataset(name, data=values)  # type: ignore[attr-defined]
            item.attrs["MATLAB_class"] = np.bytes_(kind)
            return item.ref

        elements, log = file.create_group("#refs#"), file.create_group("log")
        log.attrs["MATLAB_class"] = np.bytes_("struct")
        stored(log, "time", TIME[None, :])
        log["elsewhere"] = h5py.ExternalLink(str(others), "secret")
        fields = log.create_group("signals")
        fields.attrs["MATLAB_class"] = np.bytes_("struct")
        text = {name: np.array([[ord(c)] for c in name], np.uint16) for name in ("theta", "tau")}
        columns = {
            "values": [stored(elements, "a", ANGLE[None, :]), stored(elements, "b", TORQUE[None])],
            "label": [stored(elements, f"n{n}", text[n], "char") for n in text],
        }
        for name, parts in columns.items():
            fields.create_dataset(name, data=np.array([parts], dtype=h5py.ref_dtype))


def test_an_array_of_structures_of_version_7_3_is_followed_and_links_are_not(
    tmp_path: Path,
) -> None:
    path = tmp_path / "log.mat"
    mat73(path, tmp_path / "other.h5")
    assert not any("secret" in c.name or "elsewhere" in c.name for c in read_table(path).columns)
    right(imported(path))


@pytest.mark.parametrize(
    "form", ["t_ms:{},pos_deg:{},tau_Nm:{}", "t={} ms; pos = {} deg; tau={} Nm"]
)
def test_lines_that_name_each_value_are_rows(form: str, tmp_path: Path) -> None:
    lines = ["Bench 7, boot mode:(3,6)", "HX711 ready"]
    for k, time in enumerate(TIME):
        lines += ["Direction changes"] * (k == 70)
        lines += [form.format(round(1e3 * time), f"{DEG[k]:.6f}", f"{TORQUE[k]:.6f}")]
    path = tmp_path / "serial.log"
    path.write_text("\r\n".join([*lines, "Done"]))
    guess = guess_columns(read_table(path))
    assert "1 lines of words between the rows are left out" in guess.table.notes
    right(run_of(streams_of(guess), {}))


def test_lines_that_are_interrupted_or_cut_off_are_left_out(tmp_path: Path) -> None:
    lines = [f"t_ms:{round(1e3 * t)},pos_deg:{x:.4f},tau_Nm:{m:.4f}" for t, x, m in
             zip(TIME, DEG, TORQUE, strict=True)]  # fmt: skip
    lines[80] = lines[80][:14] + lines[81]
    path = tmp_path / "serial.log"
    path.write_text("\n".join(lines)[:-3])
    run = imported(path)
    assert "no line end and is left out" in " ".join(read_table(path).notes)
    assert run.time == pytest.approx(np.delete(TIME, [80, 199]), abs=1e-9)
    assert run["motor_torque"] == pytest.approx(np.delete(TORQUE, [80, 199]), abs=1e-4)


def spreadsheet(rows: list[str]) -> str:
    body = [f"{comma(t)};{comma(x)};{comma(m)};" for t, x, m in
            zip(TIME, DEG, TORQUE, strict=True)]  # fmt: skip
    body[33] = f"{comma(TIME[33])};{comma(DEG[33])};#DIV/0!;"
    return "\r\n".join(["Temps (s);Angle (°);Couple (N.m);", *body, ";;;", *rows]) + "\r\n"


@pytest.mark.parametrize("rows", [[], ["Moyenne;1,0;0,5;"], ["min;0,1;0,1;", "max;9,9;9,9;"]])
def test_errors_of_a_spreadsheet_are_missing_and_its_summary_is_no_sample(
    rows: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "essai.csv"
    path.write_text(spreadsheet(rows), encoding="utf-8-sig")
    right(imported(path), np.where(np.arange(200) == 33, np.nan, TORQUE))


def test_a_title_among_the_rows_is_a_fault(tmp_path: Path) -> None:
    """It is a summary at the end only."""
    lines = spreadsheet([]).splitlines()
    lines.insert(120, "Moyenne;1,0;0,5;")
    path = tmp_path / "essai.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8-sig")
    with pytest.raises(RunError, match="121: column 'Temps' has 'Moyenne'"):
        imported(path)


@pytest.mark.parametrize("form", ["npz", "json", "mat"])
def test_an_angle_that_may_be_in_degrees_is_asked_in_every_format(
    form: str, tmp_path: Path
) -> None:
    path = tmp_path / f"log.{form}"
    if form == "npz":
        np.savez(path, t=TIME, theta=DEG, tau=TORQUE)
    elif form == "mat":
        savemat(path, {"t": TIME, "theta": DEG, "tau": TORQUE})
    else:
        path.write_text(json.dumps({"t": [*TIME], "theta": [*DEG], "tau": [*TORQUE]}))
    (question,) = guess_columns(read_table(path)).questions
    assert "may be deg or rad" in question.text


@pytest.mark.parametrize("is_doubtful", [True, False])
def test_quoted_commas_that_may_separate_thousands_are_refused(
    is_doubtful: bool, tmp_path: Path
) -> None:
    """Beside a number below 1 they are decimals."""
    path = tmp_path / "log.csv"
    angle = 5 - ANGLE if is_doubtful else ANGLE
    cells = [f"{value:.3f}".replace(".", ",") for value in angle]
    rows = [f'{round(1e3 * t)},"{c}",{k % 9}' for k, (t, c) in
            enumerate(zip(TIME, cells, strict=True))]  # fmt: skip
    path.write_text("\n".join(["time [ms],angle [rad],torque [N m]", *rows]) + "\n")
    if is_doubtful:
        with pytest.raises(RunError, match="may have a separator of thousands"):
            imported(path)
    else:
        assert imported(path)["motor_angle"] == pytest.approx(ANGLE, abs=6e-4)


def test_pairs_of_x_and_y_are_the_times_and_values_of_the_channel_above(tmp_path: Path) -> None:
    """Scopes of amplifiers: object numbers in brackets are no units."""
    lines = ["Position [0x6064],,Actual torque [mNm],", "X,Y,X,Y"]
    rows = zip(TIME, ANGLE, TORQUE, strict=True)
    lines += [f"  {1e3 * t:.1f},{q:.6f},  {1e3 * t:.1f},{1e3 * m:.4f}" for t, q, m in rows]
    path = tmp_path / "scope.csv"
    path.write_text("\n".join(lines) + "\n")
    table = read_table(path)
    assert [column.source for column in table.columns] == [
        "Position [0x6064] time",
        "Position [0x6064]",
        "Actual torque [mNm] time",
        "Actual torque",
    ]
    columns = [f"time={table.columns[k].source} [ms]" for k in (0, 2)]
    (found,) = import_runs(path, columns=[*columns, "motor_angle=Position [0x6064] [rad]"])
    right(found)
