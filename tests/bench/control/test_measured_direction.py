"""A one-sided condition stops a motor that turns the forbidden way, whatever is commanded."""

from __future__ import annotations

import math

import pytest

from fake_axis import CYCLE, Rig
from winchkit.bench.control.snapshot import Phase
from winchkit.schema.bench import LimitSpec

LIMITS = LimitSpec(0.5, 1.0, (0.5, 9.0), tension_high=500.0, tension_slack=20.0)
ARM = 0.005


def jogging(winding_speed: float, length: float = 4.0) -> Rig:
    """A winch that jogs for a long time at a steady speed, from a cable length (m)."""
    rig = Rig(LIMITS)
    rig.axes["A"].angle = (4.0 - length) / ARM
    rig.step(2)
    rig.jog(winding_speed)
    rig.run(0.3)
    return rig


def turned(rig: Rig, winding_speed: float) -> None:
    """From now on the motor turns at this speed whatever is commanded."""
    axis = rig.axes["A"]
    send = axis.send

    def overrule(*args: object, **kwargs: object) -> int:
        word = send(*args, **kwargs)  # type: ignore[arg-type]
        axis.velocity = winding_speed / ARM
        return word

    axis.send = overrule  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("commanded", "kind", "tension", "length"),
    [
        (-0.02, "length", 100.0, 0.48),
        (0.02, "length", 100.0, 9.02),
        (-0.02, "tension high", 510.0, 4.0),
        (0.02, "slack", 10.0, 4.0),
    ],
)
def test_the_measured_direction_counts(
    commanded: float, kind: str, tension: float, length: float
) -> None:
    rig = jogging(commanded, length)
    axis = rig.axes["A"]
    rig.tension["A"] = tension
    rig.run(0.25)
    assert not rig.supervisor.tripped, "the commanded direction is allowed"
    turned(rig, -1.2 * commanded)
    begun, angle = rig.now, axis.angle
    while not rig.supervisor.tripped and rig.now < begun + 1.0:
        rig.step()
    assert [trip.kind for trip in rig.supervisor.tripped] == [kind]
    way = abs(axis.angle - angle) * ARM
    assert 1.9e-3 < way < 2e-3 + 0.024 * 3 * CYCLE
    assert rig.now - begun >= 0.05
    rig.step(2)
    assert rig.controller().phase in (Phase.STOPPING, Phase.DISABLED)


@pytest.mark.parametrize("amplitude", [0.9e-3, 1.9e-3])
@pytest.mark.parametrize("frequency", [2.0, 8.0])
def test_an_elastic_load_may_bounce_while_an_overload_is_paid_out(
    amplitude: float, frequency: float
) -> None:
    """The motor is turned back by less than 2 mm again and again."""
    rig = jogging(-0.02)
    rig.tension["A"] = 510.0
    axis = rig.axes["A"]
    send = axis.send
    rate = 2 * math.pi * frequency

    def bounce(*args: object, **kwargs: object) -> int:
        word = send(*args, **kwargs)  # type: ignore[arg-type]
        axis.velocity += amplitude / 2 * rate * math.cos(rate * rig.now) / ARM
        return word

    axis.send = bounce  # type: ignore[method-assign]
    rig.run(3.0)
    assert not rig.supervisor.tripped
