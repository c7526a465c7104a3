"""A winch and a bench to break, and how their faults are listed."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from winchkit.errors import FileError
from winchkit.schema.read import read_any

WINCH = """\
schema = 1
kind = "winch"
name = "w"
[drum]
kind = "spiral"
winding_radius = "60 mm"
layer_growth = "0.5 mm"
[gearbox]
ratio = 20
[reference]
"""
RADIUS = 'winding_radius = "60 mm"\n'
SIZES = RADIUS + 'layer_growth = "0.5 mm"\n'


BENCH = """\
schema = 1
kind = "bench"
[bus.can]
kind = "can"
interface = "virtual"
channel = "x"
[bus.cells]
kind = "modbus-tcp"
host = "127.0.0.1"
port = 502
[winch.A]
profile = "w"
servo = { device = "generic-cia402", bus = "can", node = 1, encoder = "absolute" }
cell = { device = "laumas-tlb", bus = "cells", unit = 1 }
limits = { speed = "0.5 m/s" }
"""
ONE_WINCH = """\
schema = 1
kind = "bench"
cycle = "4 ms"
[bus.can]
kind = "can"
interface = "virtual"
channel = "one-winch"
[winch.A]
profile = "bench-spiral"
servo = { device = "generic-cia402", bus = "can", node = 1, encoder = "absolute" }
[winch.A.limits]
speed = "0.5 m/s"
acceleration = "1 m/s^2"
"""


def faults_of(path: Path, text: str) -> list[tuple[int | None, str, str]]:
    """Line, key and message of every fault of a text, in order."""
    path.write_text(textwrap.dedent(text))
    with pytest.raises(FileError) as caught:
        read_any(path)
    assert caught.value.exit_code == 3
    return [(fault.line, fault.key, fault.message) for fault in caught.value.faults]
