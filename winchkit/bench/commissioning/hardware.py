"""Winches that only hardware stops when the host dies, for the warning at every start."""

from __future__ import annotations

import sys

from winchkit.schema.bench import BenchSpec


def tell_hardware(spec: BenchSpec) -> None:
    """Say on stderr which winches those are, and what stops them."""
    for name, winch in spec.winch.items():
        if winch.host_loss:
            sys.stderr.write(
                f"winch {name}: its drive does not notice when this computer falls silent; what "
                f"stops the winch then is {winch.host_loss_description}\n"
            )
