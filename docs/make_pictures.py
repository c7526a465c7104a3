"""Draws docs/pictures: ``python docs/make_pictures.py``, with matplotlib (extra ``plot``).

``cogging.svg`` needs recordings of others, in the folder that WINCHKIT_REAL names, and stays as it is
without them.
"""

from __future__ import annotations

import os
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("svg")
import matplotlib.pyplot as plt

from winchkit import Run, add, find, read_profile, read_programme, read_run, read_simbench, simulate
from winchkit.effects import line_of
from winchkit.effects.term import modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.schema.profiles.winch import WinchProfile

PICTURES = Path(__file__).parent / "pictures"
_STYLE = {
    "svg.hashsalt": "winchkit",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.figsize": (6.4, 3.0),
    "figure.constrained_layout.use": True,
}
