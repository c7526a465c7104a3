"""Reader of a file of another program in the format of its content, not of its suffix."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from io import BytesIO
from pathlib import Path

from winchkit.errors import Fault, RunError
from winchkit.regular_file import read_whole
from winchkit.runs.importing.formats.cells import with_cell_units
from winchkit.runs.importing.formats.channel_table import by_channel
from winchkit.runs.importing.formats.point_table import with_coordinates
from winchkit.runs.importing.formats.split_stamps import joined_stamps
from winchkit.runs.importing.table import LARGEST, ColumnTable

_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_table(path: str | Path) -> ColumnTable:
    """Read a file of any format, columns in its units.

    Raises RunError for a file that cannot be read, an unknown format, and one without numbers;
    UsageError without the library of the format.
    """
    table = _read(path)
    units = replace(table, columns=tuple(with_cell_units(item) for item in table.columns))
    return by_channel(joined_stamps(with_coordinates(units)))


def _read(path: str | Path) -> ColumnTable:
    """Columns as they are in the file."""
    name, data = str(path), _content(Path(path))
    if data.startswith(b"PK\x03\x04"):
        return _packed(name, data)
    if data.startswith((b"MATLAB", _HDF5)) or _HDF5 in data[:1024] or _is_mat4(path, data):
        return _of_arrays(name, data)
    if data.startswith((b"PAR1", b"\x93NUMPY")):
        from winchkit.runs.importing.formats.measurement_files import read_numpy, read_parquet

        return (read_parquet if data.startswith(b"PAR1") else read_numpy)(name, data)
    if data.startswith(b"\x89MCAP0\r\n"):
        from winchkit.runs.importing.formats.messages import read_messages

        return read_messages(name, data)
    if data.startswith((b"MDF ", b"TDSm")):
        from winchkit.runs.importing.formats.measurement_files import read_mdf, read_tdms

        return (read_mdf if data.startswith(b"MDF ") else read_tdms)(name, data)
    return _of_text(name, data)


def _of_text(name: str, data: bytes) -> ColumnTable:
    """JSON, or rows of text."""
    from winchkit.can_trace import TRACE, is_trace
    from winchkit.runs.importing.formats.fields import read_labelled
    from winchkit.runs.importing.formats.json_file import is_json, read_json
    from winchkit.runs.importing.formats.motion_capture import read_capture
    from winchkit.runs.importing.formats.text import read_text_table

    _refuse_known(name, data)
    if is_trace(data):
        raise RunError(Fault(TRACE, name))
    table = read_json(name, data) if is_json(data) else read_capture(name, data)
    return table or read_labelled(name, data) or read_text_table(name, data)


def _of_arrays(name: str, data: bytes) -> ColumnTable:
    """MAT of version 5 or 7.3, or HDF5, whose signature stands behind a user block."""
    from winchkit.runs.importing.formats.matlab import read_hdf5, read_mat

    return (read_hdf5 if _HDF5 in data[:1024] else read_mat)(name, data)


def _content(path: Path) -> bytes:
    """Content of a regular file; raises RunError where it cannot be read."""
    data = read_whole(path, "recording", LARGEST, RunError)
    if not data:
        raise RunError(Fault("the file is empty", str(path)))
    if len(data) > LARGEST:
        message = f"is larger than {LARGEST / 1e9:.3g} GB; split the recording"
        raise RunError(Fault(message, str(path)))
    return data


def _packed(name: str, data: bytes) -> ColumnTable:
    try:
        with zipfile.ZipFile(BytesIO(data)) as packed:
            names = packed.namelist()
    except zipfile.BadZipFile as error:
        raise RunError(Fault(f"is a damaged ZIP archive: {error}", name)) from None
    if any(item.startswith("xl/") for item in names):
        from winchkit.runs.importing.formats.measurement_files import read_workbook

        return read_workbook(name, data)
    if names and all(item.endswith(".npy") for item in names):
        from winchkit.runs.importing.formats.measurement_files import read_numpy

        return read_numpy(name, data)
    message = f"is an archive of {', '.join(names[:3])} …; unpack it and import the files in it"
    raise RunError(Fault(message, name))


def _is_mat4(path: str | Path, data: bytes) -> bool:
    """Whether a file called .mat is of version 4, which has no signature."""
    return Path(path).suffix.lower() == ".mat" and b"\0" in data[:16]


_KNOWN = {
    b"\x1f\x8b": "is compressed by gzip; unpack it first",
    b"\xd0\xcf\x11\xe0": "is an old Excel file (XLS); save it as XLSX or CSV",
    b"\x02P": (
        "is a C3D file of motion capture; export a rigid body (6D) or markers from it as text "
        "(TSV, TRC, CSV)"
    ),
    b"#ROSBAG": (
        "is a bag of ROS 1; export the topic with the joints as text, by rostopic echo -b FILE -p "
        "TOPIC > log.csv, and import that"
    ),
    b"%PDF": "is a PDF document",
    b"SQLite format 3": "is an SQLite database (perhaps a ROS 2 bag); convert it to MCAP or CSV",
}


def _refuse_known(name: str, data: bytes) -> None:
    for mark, message in _KNOWN.items():
        if data.startswith(mark):
            raise RunError(Fault(message, name))
