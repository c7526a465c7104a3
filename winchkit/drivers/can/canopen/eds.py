"""The object dictionary of an EDS or DCF, as canopen holds it."""

from __future__ import annotations

import configparser
import io
from pathlib import Path
from typing import Any

from canopen.objectdictionary import eds as _canopen_eds

from winchkit.errors import Fault, FileError
from winchkit.schema.eds.eds import read_eds_text


def read_eds(path: Path, node: int) -> tuple[Any, tuple[Fault, ...]]:
    """Object dictionary of an EDS or DCF for a node id, with warnings; raises FileError."""
    eds = read_eds_text(path)
    library: Any = _canopen_eds
    try:
        return library.import_eds(io.StringIO(eds.text), node), eds.warnings
    except (ValueError, KeyError, configparser.Error) as error:
        raise FileError(Fault(f"cannot be read as an EDS: {error}", str(path))) from error
