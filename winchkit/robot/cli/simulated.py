"""A robot of ``sim/`` on its bench in simulated time: ``winchkit sim record`` and ``calibrate``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench
    from winchkit.schema.robot_programme import RobotProgramme
    from winchkit.schema.simbench import SimBench

_INSTRUMENTS = 0.5
"""Time in which every instrument of a simulated bench has been read, s."""


@contextmanager
def simulated_robot(sim: SimBench, seed: int = 0) -> Iterator[Bench]:
    """The bench of a simulated robot with its tracker, by CAN frames and transactions."""
    from winchkit.bench.open import open_bench
    from winchkit.sim.clock.simulated_clock import SimulatedClock
    from winchkit.sim.live.bench import LiveBench

    clock = SimulatedClock()
    with (
        LiveBench(sim, seed=seed, simulated_time=clock, compiled=True) as live,
        open_bench(live.bench_spec, clock) as opened,
    ):
        # The bench receives its tracker from the first use on.
        _ = opened.tracker
        clock.sleep(_INSTRUMENTS)
        yield opened


def record_robot(
    programme: RobotProgramme,
    sim: SimBench,
    folder: Path,
    suffix: str,
    *,
    seed: int,
    tell: Callable[[str], None],
    replace: bool = False,
) -> list[Path]:
    """Run a robot programme on a simulated bench; returns its logs, one per repeat. Raises
    UsageError for a bench without a robot, and for logs that are not to be replaced."""
    from winchkit.errors import UsageError
    from winchkit.robot.bench.programme import run_robot_programme

    if sim.bench.robot is None:
        raise UsageError(
            f"{sim.name} declares no robot, and '{programme.name}' is a robot programme; name a "
            "robot, such as cabtive-robot (winchkit sim list), or a motion programme"
        )

    def progress(repeat: int, number: int) -> None:
        tell(f"{programme.name} {repeat}/{programme.repeat}, motion {number}")

    with simulated_robot(sim, seed) as opened:
        return run_robot_programme(
            opened, programme, folder, suffix=suffix, progress=progress, replace_files=replace
        )
