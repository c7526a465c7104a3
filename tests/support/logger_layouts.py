"""The same motion in the layouts of many loggers, with numbers of our own.

Each layout writes the signals of :func:`motion` to a file and names the answers that the file
itself cannot give. The layouts follow what the programs write: title lines, rows of units,
delimiters, decimal signs, names and clocks.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array

TURN = 2 * math.pi
START = datetime(2026, 3, 4, 9, 30, 15, 250_000, tzinfo=UTC)
COUNTS, RATED, CONSTANT, SENSITIVITY, CAPACITY = 4096, 2.4, 0.12, 2.0, 500.0
RATE = 100.0
ROWS = 400


@dataclass(frozen=True)
class Motion:
    """Signals in SI, shape (n,)."""

    time: Array
    angle: Array
    velocity: Array
    torque: Array
    tension: Array

    @property
    def channels(self) -> dict[str, Array]:
        """By channel of a run."""
        return {
            "motor_angle": self.angle,
            "motor_velocity": self.velocity,
            "motor_torque": self.torque,
            "tension": self.tension,
        }


@cache
def motion() -> Motion:
    """A lift with two tones: the velocity is the exact derivative of the angle."""
    t = np.arange(ROWS) / RATE
    w, u = 1.3, 4.1
    angle = 20 * (1 - np.cos(w * t)) + 3 * np.sin(u * t) + 2.0 * t
    velocity = 20 * w * np.sin(w * t) + 3 * u * np.cos(u * t) + 2.0
    torque = 0.6 + 0.05 * np.tanh(velocity / 3) + 2e-4 * velocity
    tension = 150.0 + 4.0 * np.cos(w * t) + 1.5 * np.sin(u * t)
    return Motion(t, angle, velocity, torque, tension)


@dataclass(frozen=True)
class Layout:
    """One way to write the motion."""

    name: str
    suffix: str
    write: Callable[[Path], None]
    answers: dict[str, Any] = field(default_factory=dict)
    """Fields of ``Answers``; ``columns`` as texts of ``--column``."""
    channels: tuple[str, ...] = ("motor_angle", "motor_velocity", "motor_torque", "tension")
    needs: str = ""
    """Library of an extra."""
    tolerance: float = 2e-6
    """Largest error, as a share of the channel's range."""


def _rows(columns: Sequence[Sequence[Any]], mark: str, decimal: str = ".") -> list[str]:
    def cell(value: Any) -> str:
        if isinstance(value, str):
            return value
        return "" if math.isnan(value) else f"{value:.10g}".replace(".", decimal)

    return [mark.join(cell(value) for value in row) for row in zip(*columns, strict=True)]


def _text(
    columns: Sequence[Sequence[Any]],
    above: Sequence[str],
    mark: str = ",",
    decimal: str = ".",
    end: str = "\n",
    encoding: str = "utf-8",
    below: str = "",
) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        lines = [*above, *_rows(columns, mark, decimal)]
        path.write_bytes((end.join(lines) + end + below).encode(encoding))

    return write


def _stamps(form: str) -> list[str]:
    moments = [START + timedelta(seconds=float(t)) for t in motion().time]
    if form == "iso":
        return [m.strftime("%Y-%m-%dT%H:%M:%S.%fZ") for m in moments]
    if form == "date":
        return [m.strftime("%d.%m.%Y") for m in moments]
    if form == "clock":
        return [m.strftime("%H:%M:%S,%f")[:-3] for m in moments]
    if form == "us":
        return [m.strftime("%m/%d/%Y %I:%M:%S.%f %p") for m in moments]
    late = [m + timedelta(hours=14, minutes=29, seconds=43) for m in moments]
    return [m.strftime("%H:%M:%S.%f") for m in late]


def _standard(scale: Sequence[float] = (1, 1, 1, 1, 1)) -> list[Array]:
    m = motion()
    values = (m.time, m.angle, m.velocity, m.torque, m.tension)
    return [value * factor for value, factor in zip(values, scale, strict=True)]


_DEG, _RPM = 180 / math.pi, 60 / TURN


def _twincat(path: Path) -> None:
    m = motion()
    names = ("fActPos", "fActVelo", "fActTorque", "fCellForce")
    units = ("° (Angle)", "1/min", "Nm (Torque)", "N (Force)")
    values = (m.angle * _DEG, m.velocity * _RPM, m.torque, m.tension)
    lines = [
        "Name\tScope Project",
        "File\tC:\\logs\\lift.csv",
        "Starttime of export\t133700000000000000\tMittwoch, 4. März 2026\t09:30:15.250",
        "Endtime of export\t133700000040000000\tMittwoch, 4. März 2026\t09:30:19.250",
        "",
        "",
        "\t".join(f"Name\t{name}" for name in names),
        "\t".join("SymbolComment\t" for _ in names),
        "\t".join("Data-Type\tREAL64" for _ in names),
        "\t".join("SampleTime[ms]\t10" for _ in names),
        "\t".join(f"SymbolName\tMAIN.{name}" for name in names),
        "\t".join("Offset\t0" for _ in names),
        "\t".join("ScaleFactor\t1" for _ in names),
        "\t".join(f"Unit\t{unit}" for unit in units),
        "",
    ]
    columns = [column for value in values for column in (m.time * 1e3, value)]
    path.write_text("\n".join([*lines, *_rows(columns, "\t", ",")]) + "\n", encoding="utf-8")


def _twincat_shared(path: Path) -> None:
    """One time for channels of one rate; rows are shorter once the slower channels have ended."""
    m = motion()
    every = slice(0, ROWS, 2)
    lines = ["Name\tScope", "File\tlift.csv", "", ""]
    for key, fast, slow in (
        ("Name", "fActPos\tfActVelo\tfActTorque", "fCellForce"),
        ("SymbolComment", "\t\t", ""),
        ("Data-Type", "REAL64\tREAL64\tREAL64", "REAL64"),
        ("SampleTime[ms]", "10\t10\t10", "20"),
        ("VariableSize", "8\t8\t8", "8"),
        ("Unit", "° (Angle)\t1/min\tNm (Torque)", "N (Force)"),
    ):
        lines.append(f"{key}\t{fast}\t{key}\t{slow}")
    lines.append("")
    fast_rows = _rows([m.time * 1e3, m.angle * _DEG, m.velocity * _RPM, m.torque], "\t", ",")
    slow_rows = _rows([m.time[every] * 1e3, m.tension[every]], "\t", ",")
    for k, row in enumerate(fast_rows):
        lines.append(f"{row}\t{slow_rows[k]}" if k < len(slow_rows) else row)
    path.write_text("\n".join([*lines, "EOF"]) + "\n", encoding="utf-8")


def _lvm(
    columns: Sequence[Array | list[str]], names: str, step: str, decimal: str
) -> Callable[[Path], None]:
    head = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        f"Decimal_Separator\t{decimal}",
        "Multi_Headings\tNo",
        "X_Columns\tOne",
        "Time_Pref\tRelative",
        "Operator\tlab",
        "Date\t2026/03/04",
        "Time\t09:30:15,25",
        "***End_of_Header***\t",
        "\t",
        "Channels\t4\t\t\t\t",
        "Samples\t400\t400\t400\t400\t",
        "Date\t2026/03/04\t2026/03/04\t2026/03/04\t2026/03/04\t",
        "Y_Unit_Label\tVolts\tVolts\tVolts\tVolts\t",
        "X_Dimension\tTime\tTime\tTime\tTime\t",
        "X0\t0.0000000000000000E+0\t0.0\t0.0\t0.0\t",
        f"Delta_X\t{step}\t{step}\t{step}\t{step}\t",
        "***End_of_Header***\t\t\t\t\t",
        names,
    ]
    return _text(columns, head, "\t", decimal, "\r\n")


def _many_rates(path: Path) -> None:
    """The cell at a fifth of the rate: its cells are empty between its samples."""
    m = motion()
    tension = np.where(np.arange(ROWS) % 5 == 0, m.tension, np.nan)
    columns = [m.time, m.angle, m.velocity, m.torque, tension]
    _text(columns, ["time [s],angle [rad],speed [rad/s],torque [Nm],force [N]"])(path)


def _many_clocks(path: Path) -> None:
    """A time column before each block of channels; the cell's is shorter, at half the rate."""
    m = motion()
    every = slice(0, ROWS, 2)
    short = np.full(ROWS, np.nan)
    clock, tension = short.copy(), short.copy()
    clock[: ROWS // 2], tension[: ROWS // 2] = m.time[every], m.tension[every]
    columns = [m.time, m.angle, m.velocity, m.torque, clock, tension]
    head = "Time (s),Motor angle (rad),Motor speed (rad/s),Motor torque (Nm),Time (s),Force (N)"
    _text(columns, [head])(path)


def _workbook(rows: list[list[Any]]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        import openpyxl

        book = openpyxl.Workbook()
        sheet = book.active
        assert sheet is not None
        for row in rows:
            sheet.append(row)
        notes = book.create_sheet("Notes")
        notes.append(["measured by the lab"])
        book.save(path)

    return write


def _xlsx_numbers(path: Path) -> None:
    table = [
        list(map(float, row)) for row in zip(*_standard((1e3, _DEG, _RPM, 1, 1e-3)), strict=True)
    ]
    head = [["Measurement 12"], [], ["Zeit", "Winkel", "Drehzahl", "Drehmoment", "Seilkraft"]]
    _workbook([*head, ["ms", "°", "1/min", "Nm", "kN"], *table])(path)


def _xlsx_dates(path: Path) -> None:
    naive = START.replace(tzinfo=None)
    table = [
        [naive + timedelta(milliseconds=round(t * 1e3)), *map(float, row)]
        for t, *row in zip(*_standard(), strict=True)
    ]
    head = ["Timestamp", "Motor angle [rad]", "Motor speed [rad/s]", "Torque [Nm]", "Tension [N]"]
    _workbook([head, *table])(path)


def _mat(path: Path) -> None:
    from scipy.io import savemat

    m = motion()
    columns = {"t": m.time, "q": m.angle, "dq": m.velocity, "tau": m.torque, "force": m.tension}
    savemat(path, {name: value.reshape(-1, 1) for name, value in columns.items()})


def _mat_struct(path: Path) -> None:
    from scipy.io import savemat

    m = motion()
    data = {"time": m.time, "motor": {"position": m.angle, "speed": m.velocity, "torque": m.torque}}
    savemat(path, {"log": {**data, "cell": {"force": m.tension}, "operator": "lab"}})


def _mat_drive(path: Path) -> None:
    """A force constant beside the drive's current, as a variable."""
    from scipy.io import savemat

    m = motion()
    variables = {"t": m.time, "q": m.angle, "dq": m.velocity, "iq": m.torque / CONSTANT}
    savemat(path, {**variables, "tension": m.tension, "Kt": CONSTANT})


def _hdf5(path: Path) -> None:
    import h5py

    m = motion()
    with h5py.File(path, "w") as file:
        for name, value, unit in (
            ("drive/time", m.time * 1e3, "ms"),
            ("drive/position", m.angle / TURN, "turns"),
            ("drive/velocity", m.velocity * _RPM, "rpm"),
            ("drive/torque", m.torque * 1e3, "mNm"),
            ("cell/force", m.tension, "N"),
        ):
            file.create_dataset(name, data=value).attrs["units"] = unit


def _mat73(path: Path) -> None:
    import h5py

    m = motion()
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (
            ("t", m.time),
            ("q", m.angle),
            ("dq", m.velocity),
            ("tau", m.torque),
            ("tension", m.tension),
        ):
            data = file.create_dataset(name, data=value.reshape(1, -1))
            data.attrs["MATLAB_class"] = np.bytes_(b"double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as stream:
        stream.write(head)


def _npz(path: Path) -> None:
    m = motion()
    np.savez(path, t_ms=m.time * 1e3, pos_deg=m.angle * _DEG, speed_rpm=m.velocity * _RPM,
             torque_Nm=m.torque, force_N=m.tension)  # fmt: skip


def _npy(path: Path) -> None:
    kind = [(name, "f8") for name in ("time", "q", "dq", "tau", "tension")]
    table = np.zeros(ROWS, dtype=kind)
    for (name, _), value in zip(kind, _standard(), strict=True):
        table[name] = value
    np.save(path, table)


def _parquet(path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    m = motion()
    nanoseconds = [int((START.timestamp() + t) * 1e9) for t in m.time]
    fields = {
        "timestamp": pa.array(nanoseconds, pa.timestamp("ns", "UTC")),
        "motor_position (deg)": pa.array(m.angle * _DEG),
        "motor_speed (rpm)": pa.array(m.velocity * _RPM),
        "motor_torque (Nm)": pa.array(m.torque),
        "load_cell (N)": pa.array(m.tension),
    }
    parquet.write_table(pa.table(fields), path)


def _mcap_json(path: Path) -> None:
    from mcap.writer import Writer

    m = motion()
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("Joints", "jsonschema", b'{"type":"object"}')
        joints = writer.register_channel("/joint_states", "json", schema)
        cell = writer.register_channel("/load_cell", "json", schema)
        for k in range(ROWS):
            stamp = int(START.timestamp() * 1e9) + k * 10_000_000
            state = {
                "name": ["winch"],
                "position": [m.angle[k]],
                "velocity": [m.velocity[k]],
                "effort": [m.torque[k]],
            }
            writer.add_message(joints, stamp, json.dumps(state).encode(), stamp)
            force = json.dumps({"force": m.tension[k]}).encode()
            writer.add_message(cell, stamp, force, stamp)
        writer.finish()


def _mcap_ros2(path: Path) -> None:
    from mcap_ros2.writer import Writer

    m = motion()
    joint = "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    with path.open("wb") as stream:
        writer = Writer(stream)
        state = writer.register_msgdef("sensor_msgs/msg/JointState", joint)
        cell = writer.register_msgdef("std_msgs/msg/Float64", "float64 data\n")
        for k in range(ROWS):
            stamp = int(START.timestamp() * 1e9) + k * 10_000_000
            value = {
                "name": ["winch"],
                "position": [float(m.angle[k])],
                "velocity": [float(m.velocity[k])],
                "effort": [float(m.torque[k])],
            }
            writer.write_message("/joint_states", state, value, stamp, stamp)
            writer.write_message("/tension", cell, {"data": float(m.tension[k])}, stamp, stamp)
        writer.finish()


def _layouts() -> list[Layout]:
    m = motion()
    epoch = START.timestamp()
    deg_rpm = _standard((1, _DEG, _RPM, 1, 1))
    drive = ("motor_angle", "motor_velocity", "motor_torque")
    serial = np.array([46085.0 + (9 * 3600 + 30 * 60 + 15.25 + t) / 86_400 for t in m.time])
    counted = [m.time * 1e3, m.angle / TURN * COUNTS, m.velocity * _RPM, m.torque / RATED * 1e3]
    return [
        Layout("winchkit", ".csv", _text(_standard(), [
            "time [s],motor_angle [rad],motor_velocity [rad/s],motor_torque [N m],tension [N]"])),
        Layout("twincat-scope", ".csv", _twincat),
        Layout("labview-lvm", ".lvm", _lvm(
            _standard(), "X_Value\tAngle (rad)\tSpeed (rad/s)\tTorque (Nm)\tForce (N)\tComment",
            "0.010000", "."), tolerance=1e-6),
        Layout("labview-lvm-without-x", ".lvm", _lvm(
            [[""] * ROWS, *_standard()[1:]],
            "X_Value\tAngle (rad)\tSpeed (rad/s)\tTorque (Nm)\tForce (N)\tComment",
            "0,010000", ",")),
        Layout("catman-ascii", ".asc", _text(deg_rpm, [
            "HBM_CATMAN_DATAFILE",
            "T0 = 04.03.2026 09:30:15",
            "Kommentar: Hub 3, 15 kg",
            "",
            "Zeit  1 - Standardmessrate\tMX840A CH 1 Winkel\tMX840A CH 2 Drehzahl\t"
            "MX460 CH 3 Drehmoment\tMX440 CH 4 Seilkraft",
            "s\tGrad\tU/min\tNm\tN",
        ], "\t", ",", "\r\n", "cp1252")),
        Layout("picoscope", ".csv", _text(_standard((1e3, 1, 1, 1, 1)), [
            "Time,Motor angle,Motor speed,Torque,Force", "(ms),(rad),(rad/s),(Nm),(N)", ""])),
        Layout("siemens-trace", ".csv", _text(_standard((1e6, _DEG, _DEG, 1, 1)), [
            '"Trace";"Hubwerk"', '"Abtastzeit";"10 ms"', "",
            "Zeit;Lageistwert;Istgeschwindigkeit;Drehmomentistwert;Kraftistwert",
            "[µs];[°];[°/s];[Nm];[N]"], ";", ",", "\r\n", "utf-8-sig")),
        Layout("epos-studio", ".txt", _text(counted, [
            "Time [ms]\tPosition actual value [inc]\tVelocity actual value [rpm]\t"
            "Torque actual value [‰]"], "\t"),
            {"counts_per_turn": COUNTS, "rated_torque": RATED}, drive),
        Layout("epos-studio-counts-from-velocity", ".txt", _text(counted, [
            "Time [ms]\tPosition actual value [inc]\tVelocity actual value [rpm]\t"
            "Torque actual value [‰]"], "\t"), {"rated_torque": RATED}, drive),
        Layout("elmo", ".csv", _text(
            [m.time, m.angle / TURN * COUNTS, m.velocity / TURN * COUNTS, m.torque / CONSTANT],
            ['"Time[sec]","Position[cnt]","Velocity[cnt/sec]","Active Current[A]"']),
            {"counts_per_turn": COUNTS, "torque_constant": CONSTANT}, drive),
        Layout("odrive", ".csv", _text(
            [[f"{epoch + t:.6f}" for t in m.time], m.angle / TURN, m.velocity / TURN,
             m.torque / CONSTANT],
            ["timestamp,pos_estimate,vel_estimate,Iq_measured [A]"]),
            {"torque_constant": CONSTANT}, drive, tolerance=1e-6),
        Layout("kistler", ".csv", _text(_standard((1, _DEG, _DEG, 1, 1e-3)), [
            "Kistler BlueDAQ;V 2", "Messstelle;Winde 1", "Datum;04.03.2026", "",
            "Zeit [s];Drehwinkel [°];Winkelgeschwindigkeit [°/s];Drehmoment [N·m];Zugkraft [kN]"],
            ";", ",")),
        Layout("saleae", ".csv", _text(deg_rpm, [
            "Time [s],Motor Angle (deg),Motor Speed (rpm),Torque (Nm),Load Cell (N)"])),
        Layout("tdms-as-text", ".txt", _text(_standard((1, 1, 1, 1, 1)), [
            "Root Name\tTitle\tAuthor\tDate/Time\tGroups\tDescription",
            "lift\t\tlab\t\t1\t", "",
            "Group\tChannels\tDescription\tName", "drive\t5\t\tlift", "",
            "t\tAngle_rad\tSpeed_rad/s\tTorque_Nm\tForce_N"], "\t")),
        Layout("excel-german-date-and-time", ".csv", _text(
            [_stamps("date"), _stamps("clock"), *deg_rpm[1:]],
            ["Datum;Uhrzeit;Winkel [°];Drehzahl [1/min];Drehmoment [Nm];Kraft [N]"],
            ";", ",", "\r\n", "utf-8-sig")),
        Layout("iso-stamps", ".csv", _text([_stamps("iso"), *deg_rpm[1:]], [
            "timestamp,pos_deg,speed_rpm,torque_Nm,tension_N"])),
        Layout("american-stamps", ".csv", _text([_stamps("us"), *deg_rpm[1:]], [
            "Date/Time,Position (deg),Speed (RPM),Torque (N-m),Force (N)"])),
        Layout("time-of-day-over-midnight", ".csv", _text([_stamps("midnight"), *deg_rpm[1:]], [
            "Time,Position (deg),Speed (rpm),Torque (Nm),Force (N)"])),
        Layout("epoch-ms", ".csv", _text(
            [[f"{round((epoch + t) * 1e3)}" for t in m.time], *deg_rpm[1:]],
            ["time,angle/deg,speed/rpm,torque/Nm,force/N"])),
        Layout("epoch-ns", ".csv", _text(
            [[f"{round(epoch * 1e3) * 1_000_000 + k * 10_000_000}" for k in range(ROWS)],
             *deg_rpm[1:]], ["stamp;angle in deg;speed in rpm;torque in Nm;force in N"], ";"),
            tolerance=2e-6),
        Layout("excel-serial", ".csv", _text(
            [[f"{value:.12f}" for value in serial], *deg_rpm[1:]],
            ["Time,Angle (deg),Speed (rpm),Torque (Nm),Force (N)"]), tolerance=2e-6),
        Layout("utf-16", ".txt", _text(deg_rpm, [
            "Zeit [s]\tWinkel [°]\tDrehzahl [min-1]\tDrehmoment [Nm]\tKraft [N]"],
            "\t", ",", "\r\n", "utf-16")),
        Layout("no-header", ".dat", _text(deg_rpm, [], "  "), {"columns": (
            "motor_angle=2 [deg]", "motor_velocity=3 [rpm]", "motor_torque=4 [N m]",
            "tension=5 [N]")}),
        Layout("quoted-with-trailing-separators", ".csv", lambda path: path.write_text(
            '"Time (s)";"Angle (deg)";"Speed (rpm)";"Torque (Nm)";"Force (N)";\n' + "".join(
                ";".join(f'"{v:.10g}"'.replace(".", ",") for v in row) + ";\n"
                for row in zip(*deg_rpm, strict=True)), encoding="utf-8") and None),
        Layout("repeated-header-and-comments", ".csv", lambda path: path.write_text(
            "# logger 7\n" + "".join(
                "# t_s,pos_rad,vel_rad/s,torque_Nm,force_N\n" * (k % 100 == 0)
                + "# mark\n" * (k == 150) + line + "\n"
                for k, line in enumerate(_rows(_standard(), ","))), encoding="utf-8") and None),
        Layout("rostopic-echo", ".csv", _text(
            [[f"{round(epoch * 1e3) * 1_000_000 + k * 10_000_000}" for k in range(ROWS)],
             *_standard()[1:]],
            ["%time,field.position0,field.velocity0,field.effort0,field.wrench.force"]),
            {"columns": ("motor_angle=field.position0 [rad]", "tension=5 [N]",
                         "motor_velocity=field.velocity0 [rad/s]")}),
        Layout("two-rates-with-empty-cells", ".csv", _many_rates),
        Layout("a-clock-per-rate", ".csv", _many_clocks),
        Layout("xlsx", ".xlsx", _xlsx_numbers, needs="openpyxl"),
        Layout("xlsx-dates", ".xlsx", _xlsx_dates, needs="openpyxl"),
        Layout("mat-5", ".mat", _mat),
        Layout("mat-5-struct", ".mat", _mat_struct),
        Layout("mat-5-current-and-constant", ".mat", _mat_drive),
        Layout("mat-7.3", ".mat", _mat73, needs="h5py"),
        Layout("hdf5-with-units", ".h5", _hdf5, needs="h5py"),
        Layout("parquet", ".parquet", _parquet, needs="pyarrow"),
        Layout("npz", ".npz", _npz),
        Layout("npy-structured", ".npy", _npy),
        Layout("mcap-json", ".mcap", _mcap_json),
        Layout("mcap-ros2", ".mcap", _mcap_ros2,
               {"columns": ("tension=data [N]",)}, needs="mcap_ros2"),
        Layout("french", ".csv", _text(_standard((1, _DEG, _RPM, 1, 1)), [
            "temps (s);angle (degrés);vitesse (tr/min);couple (N.m);effort de traction (N)"],
            ";", ",", encoding="cp1252")),
        Layout("spanish", ".csv", _text(_standard((1, _DEG, _RPM, 1, 1)), [
            "tiempo (s),posición (grados),velocidad (rpm),par (Nm),fuerza (N)"])),
        Layout("cut-off-in-the-last-row", ".csv", _text(deg_rpm, [
            "time_s,angle_deg,speed_rpm,torque_Nm,force_N"], below="4.0,12.3,7")),
        Layout("bars", ".txt", _text(deg_rpm, [
            "time (s)|angle (deg)|speed (rpm)|torque (Nm)|force (N)"], "|")),
        Layout("bridge-and-current", ".csv", _text(
            [m.time, m.angle * _DEG, m.velocity * _RPM, m.torque / CONSTANT * 1e3,
             m.tension / CAPACITY * SENSITIVITY],
            ["time [s],motor position [deg],motor speed [rpm],motor current [mA],cell [mV/V]"]),
            {"torque_constant": CONSTANT, "sensitivity": SENSITIVITY, "capacity": CAPACITY}),
        Layout("percent-of-rated-torque", ".csv", _text(
            [m.time, m.angle * _DEG, m.velocity * _RPM, m.torque / RATED * 100, m.tension],
            ["time [s],position [deg],speed [rpm],torque [%],force [N]"]),
            {"rated_torque": RATED}),
        Layout("velocity-of-the-other-sense", ".csv", _text(
            [m.time, m.angle * _DEG, -m.velocity * _RPM, m.torque, m.tension],
            ["time [s],position [deg],speed [rpm],torque [Nm],force [N]"])),
        Layout("speed-without-unit", ".csv", _text(
            [m.time, m.angle * _DEG, m.velocity * _RPM, m.torque, m.tension],
            ["time [s],position [deg],speed,torque [Nm],force [N]"])),
        Layout("kilograms-force", ".csv", _text(
            [m.time, m.angle * _DEG, m.velocity * _RPM, m.torque, m.tension / 9.80665],
            ["time [s],position [deg],speed [rpm],torque [Nm],load cell [kg]"])),
    ]  # fmt: skip


_JSON_KEYS = ("time [s]", "position [rad]", "speed [rad/s]", "torque [Nm]", "force [N]")


def _json_records(path: Path) -> None:
    rows = [dict(zip(_JSON_KEYS, map(float, row), strict=True))
            for row in zip(*_standard(), strict=True)]  # fmt: skip
    whole = {"motor": "m7", "kp": 32, "vin": 7.4, "gains": [1, 2, 3], "entries": rows}
    path.write_text(json.dumps(whole))


def _json_lines(path: Path) -> None:
    rows = zip(_stamps("iso"), *_standard()[1:], strict=True)
    lines = [json.dumps({"timestamp": t, "drive": {"position [rad]": a, "speed [rad/s]": v},
                         "torque [Nm]": q, "force [N]": f}) for t, a, v, q, f in rows]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")


def _json_lists(path: Path) -> None:
    path.write_text(json.dumps(dict(zip(_JSON_KEYS, map(list, _standard()), strict=True))))


def _json_rows(path: Path) -> None:
    rows = [list(row) for row in zip(*_standard(), strict=True)]
    path.write_text(json.dumps({"data": rows, "dt": 0.01, "force units": "N"}))


def _json_layouts() -> list[Layout]:
    rows = tuple(
        f"{channel}=data[{n}] [{unit}]"
        for n, (channel, unit) in enumerate(
            zip(Layout("", "", _json_rows).channels, ("rad", "rad/s", "N m", "N"), strict=True),
            start=1,
        )
    )
    return [
        Layout("json-records", ".json", _json_records),
        Layout("json-lines", ".jsonl", _json_lines),
        Layout("json-lists", ".json", _json_lists),
        Layout("json-rows", ".json", _json_rows, {"columns": rows}),
    ]


def _unusual() -> list[Layout]:
    """Layouts of no certain program: what people and scripts write."""
    m = motion()
    deg_rpm = _standard((1, _DEG, _RPM, 1, 1))
    minutes = [f"{int(t // 60):02d}:{t % 60:06.3f}" for t in m.time]
    epoch = [f"{START.timestamp() + t:.6f}" for t in m.time]
    joint = "/joint_states/winch/"
    axis = "Axis1."
    quoted = [",".join(f'"{v:.10g}"'.replace(".", ",") for v in row)
              for row in zip(*deg_rpm, strict=True)]  # fmt: skip
    backwards = [column[::-1] for column in deg_rpm]
    return [
        Layout("greek-letters", ".csv", _text(_standard(), [
            "t(s),θ (rad),ω (rad/s),τ (Nm),F_cable (N)"])),
        Layout("plotjuggler", ".csv", _text([epoch, *_standard()[1:]], [
            f"__time,{joint}position,{joint}velocity,{joint}effort,/cell/wrench/force/z"])),
        Layout("units-behind-a-blank", ".txt", _text(deg_rpm, [
            "Time (s)   Angle (deg)   Speed (rpm)  Torque (Nm)  Force (N)"], "   ")),
        Layout("index-without-name", ".csv", _text([np.arange(float(ROWS)), *deg_rpm], [
            ",time_s,pos_deg,vel_rpm,torque_Nm,force_N"])),
        Layout("minutes-and-seconds", ".csv", _text([minutes, *deg_rpm[1:]], [
            "Time;Angle (deg);Speed (rpm);Torque (Nm);Force (N)"], ";")),
        Layout("latest-row-first", ".csv", _text(backwards, [
            "time [s],angle [deg],speed [rpm],torque [Nm],force [N]"])),
        Layout("set-points-beside", ".csv", _text(
            [m.time * 1e3, m.angle * _DEG + 1, m.angle * _DEG, 0 * m.time + 1, m.velocity * _DEG,
             m.torque, m.tension],
            [f"time [ms];{axis}SetPos [°];{axis}ActPos [°];{axis}PosDiff [°];{axis}ActVelo [°/s];"
             f"{axis}ActTorque [Nm];Cell [N]"], ";", ",")),
        Layout("quoted-decimal-commas", ".csv", lambda path: path.write_text(
            '"Zeit [s]","Winkel [°]","Drehzahl [1/min]","Drehmoment [Nm]","Kraft [N]"\n'
            + "\n".join(quoted) + "\n", encoding="utf-8") and None),
        Layout("interval-above-and-no-times", ".csv", _text(
            [np.arange(float(ROWS)), *deg_rpm[1:]],
            ["Recorder;X1", "Sampling period;10 ms", "",
             "Index;Position [deg];Velocity [rpm];Torque [Nm];Force [N]"], ";")),
        Layout("row-of-types", ".csv", _text(deg_rpm, [
            "Time,Pos,Vel,Trq,Frc", "REAL,LREAL,LREAL,REAL,REAL", "s,°,1/min,Nm,N"])),
        Layout("twincat-scope-shared-times", ".csv", _twincat_shared),
        Layout("markdown", ".md", lambda path: path.write_text(
            "| t [s] | pos [deg] | vel [rpm] | torque [Nm] | force [N] |\n|---|---|---|---|---|\n"
            + "".join(f"| {line} |\n" for line in _rows(deg_rpm, " | ")), encoding="utf-8")
            and None),
        Layout("text-columns-beside", ".csv", _text(
            [m.time, ["RUN"] * ROWS, *deg_rpm[1:], ["ok, fine"] * ROWS],
            ["time [s];state;angle [deg];speed [rpm];torque [Nm];force [N];message"], ";")),
    ]  # fmt: skip


LAYOUTS: list[Layout] = [*_layouts(), *_json_layouts(), *_unusual()]
