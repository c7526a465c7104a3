"""A run: named channels over one time base, with units and metadata."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeGuard

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError, UsageError, suggest
from winchkit.rendering import Plotted
from winchkit.runs.gaps import gap_lengths
from winchkit.schema.linear_axis import rotary_name
from winchkit.tabular import Columns, Tabular
from winchkit.units import parse


def is_real(values: object) -> bool:
    """Whether an object is an array of real numbers as the package computes with, (n,)."""
    return type(values) is np.ndarray and values.dtype == np.float64 and values.ndim == 1


def real_numbers(name: str, values: object) -> Array:
    """Argument ``name`` as an array (n,), NaN where masked or missing; raises UsageError."""
    plain = np.ma.filled(values.astype(np.float64), np.nan) if _is_masked(values) else values
    found = np.asarray(plain)
    if found.dtype == object and found.ndim == 1:
        found = np.asarray([math.nan if item is None else item for item in found])
    if found.ndim != 1 or found.dtype.kind not in "fiub":
        kind = found.dtype if found.ndim == 1 else f"of shape {found.shape}"
        kind = kind if isinstance(values, np.ndarray) else f"a {type(values).__name__} ({kind})"
        raise UsageError(f"{name}: {kind} is no array of real numbers; pass one of shape (n,)")
    return np.asarray(found, dtype=np.float64)


def _is_masked(values: object) -> TypeGuard[np.ma.MaskedArray[Any, Any]]:
    return isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "fiub"


ANGLE_INTEGRATED = "integral of motor_velocity"
"""Metadata ``motor_angle`` of a run whose recording has no angle."""


@dataclass(frozen=True)
class Channel:
    """One signal: values in SI where the model uses it, else in the unit of the file."""

    values: Array
    """Shape (n,); NaN where there is no value."""
    unit: str
    column: int | None = None
    """Column in the file, counted from 1."""

    def __post_init__(self) -> None:
        """Numbers of another kind are converted; raises UsageError for what is none."""
        if not is_real(self.values):
            object.__setattr__(self, "values", real_numbers("the values of a channel", self.values))

    @property
    def missing(self) -> int:
        """Number of NaN samples."""
        return int(np.count_nonzero(np.isnan(self.values)))


@dataclass(frozen=True, repr=False)
class Run(Plotted, Tabular):
    """Channels of one recording, all of shape (n,) on ``time``, and its metadata."""

    name: str
    """Of the file, without its suffix."""
    time: Array
    """Seconds, strictly increasing, shape (n,)."""
    channels: Mapping[str, Channel]
    """Channel by name, in SI."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    """Keys and texts, e.g. ``load_mass``."""
    path: str = ""
    """File; empty where it was not read from one."""
    notes: tuple[str, ...] = ()
    """Notes of the reader, e.g. on a column that was left out."""

    def __post_init__(self) -> None:
        """Times of another kind are converted; raises UsageError for channels of other lengths."""
        if not is_real(self.time):
            object.__setattr__(self, "time", real_numbers("time", self.time))
        for name, channel in self.channels.items():
            if len(channel.values) != len(self.time):
                raise UsageError(
                    f"channel '{name}' has {len(channel.values)} values for {len(self.time)} times"
                )

    def __len__(self) -> int:
        return len(self.time)

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __getitem__(self, name: str) -> Array:
        """Values of a channel; raises RunError with the known columns."""
        try:
            return self.channels[name].values
        except KeyError:
            known = ["time", *self.channels]
            message = f"no column '{name}'; it has {', '.join(known)}" + suggest(name, known)
            raise RunError(Fault(message, self.path or self.name)) from None

    def _columns(self) -> Columns:
        return Columns(
            {"time": self.time, **{name: item.values for name, item in self.channels.items()}},
            self.units,
            {**self.metadata, "name": self.name},
            ("time",),
        )

    @property
    def units(self) -> dict[str, str]:
        """Unit by column, ``time`` first; for :func:`winchkit.run_of` after a table lost them."""
        return {"time": "s", **{name: item.unit for name, item in self.channels.items()}}

    @property
    def load_mass(self) -> float | None:
        """The known mass on the cable, kg, from the metadata ``load_mass``."""
        text = self.metadata.get("load_mass")
        return None if text is None else parse(text, "mass")

    @property
    def length_zeroed(self) -> bool:
        """Whether the length instrument was zeroed at the reference: no offset to fit."""
        return self.metadata.get("length_zeroed", "").strip().lower() in {"true", "yes", "1"}

    @property
    def is_angle_integrated(self) -> bool:
        """Whether the motor angle counts from 0 in this run: the integral of a velocity."""
        return self.metadata.get("motor_angle", "") == ANGLE_INTEGRATED

    @property
    def interval(self) -> float:
        """Median time between samples, s; NaN with fewer than two."""
        return float(np.median(np.diff(self.time))) if len(self) > 1 else float("nan")

    @property
    def gaps(self) -> int:
        """Number of gaps (see :mod:`winchkit.runs.gaps`)."""
        return len(gap_lengths(self.time, {name: self[name] for name in self}))

    def winches(self) -> list[str]:
        """Names of the winches or axes, from columns ``A.motor_angle`` or ``A.position``; ``[""]``
        without prefixes."""
        parts = [name.rpartition(".") for name in self.channels]
        return [name for name, _, end in parts if rotary_name(end) == "motor_angle"] or [""]

    def of_winch(self, winch: str) -> Run:
        """The run of one winch: its columns without prefix, the shared ones kept.

        Parameters
        ----------
        winch : str
            Name; empty for the whole run.

        Returns
        -------
        Run
            Its channels; raises RunError for a name that the run lacks.
        """
        if not winch:
            return self
        if winch not in self.winches():
            known = [name for name in self.winches() if name]
            there = f"it has {', '.join(known)}" if known else "its columns name none"
            message = f"no winch or axis '{winch}' in it; {there}" + suggest(winch, known)
            raise RunError(Fault(message, self.path or self.name))
        own = {
            name.removeprefix(f"{winch}."): channel
            for name, channel in self.channels.items()
            if name.startswith(f"{winch}.") or "." not in name
        }
        return replace(self, name=f"{self.name}:{winch}", channels=own)
