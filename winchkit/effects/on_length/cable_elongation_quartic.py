"""cable-elongation-quartic: the stiffness of the cable changes with its strain."""

from collections.abc import Callable

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyval

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage

_SOFTEST = 0.1
"""Least slope in that of the linear law: beyond it a polynomial turns over outside the loads of its
fit, and a cable ten times softer has failed."""
_TABLE = 513
"""Samples of the inverse: linear interpolation is exact to (1/512)² = 4e-6 of the largest strain,
so that the first Newton step is below `_LAST_STEP`."""
_NEWTON_STEPS = 4
"""From the table one reaches `_LAST_STEP`; three more for a start beside the kink at the softest
slope."""
_LAST_STEP = 1e-5
"""Share of the largest strain: the next step would be of its square, 1e-10."""


def apply(length: Array, at: At, values: Values) -> Array:
    """Length with the strain of the quartic law; a slack cable has none."""
    force = np.maximum(at.tension, 0.0) / values["k1"]
    bend = (values["b2"], values["b3"], values["b4"])
    strain = _solve(force, Polynomial([0.0, 1.0, *bend])) if any(bend) else force
    return length + at.stressed_length * strain


def _solve(force: Array, law: Polynomial) -> Array:
    """Strain ε ≥ 0 with law(ε) = ``force`` (T/k1): a table, then Newton from there."""
    slope = law.deriv()
    end = _soft_end(slope)

    def reach(strain: Array) -> tuple[Array, Array]:
        inner = np.minimum(strain, end)
        rate = np.maximum(polyval(inner, slope.coef), _SOFTEST)
        return polyval(inner, law.coef) + rate * (strain - inner), rate

    table = np.linspace(0.0, _largest(reach, float(np.max(force, initial=0.0))), _TABLE)
    strain = np.interp(force, reach(table)[0], table)
    for _ in range(_NEWTON_STEPS):
        value, rate = reach(strain)
        step = (value - force) / rate
        strain = strain - step
        # Convergence is quadratic: after a step this small the error is below 1e-10.
        if np.max(np.abs(step), initial=0.0) < _LAST_STEP * table[-1]:
            break
    return strain


def _soft_end(slope: Polynomial) -> float:
    """Strain from which the law continues as a straight line, so that its inverse is unique."""
    roots = (slope - _SOFTEST).roots()
    real = roots.real[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)]
    return float(np.min(real, initial=1.0))


def _largest(reach: Callable[[Array], tuple[Array, Array]], force: float) -> float:
    """An upper bound of the strain at the largest force, by doubling the linear value."""
    strain = force
    while strain < force / _SOFTEST and float(reach(np.array(strain))[0]) < force:
        strain *= 2
    return strain


EFFECT = Effect(
    id="cable-elongation-quartic",
    stage=Stage.CABLE,
    parameters=(
        Parameter("k1", "N", null=np.inf, typical=2e5, low=1e3, high=np.inf, reciprocal=True),
        Parameter("b2", "1", null=0.0, typical=100.0, low=-1e4, high=1e5, role="shape"),
        Parameter("b3", "1", null=0.0, typical=3e4, low=-1e7, high=1e8, role="shape"),
        Parameter("b4", "1", null=0.0, typical=1e7, low=-1e10, high=1e11, role="shape"),
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="load",
    reduces_to=("cable-elongation-linear",),
    what="The stiffness of the cable depends on its strain: strands bed in.",
    formula="ℓ + ℓ_s ε with T/k1 = ε + b2 ε² + b3 ε³ + b4 ε⁴, straight where softer than k1/10",
    source="IPAnema 3 paper, Eq. 5, re-based to zero strain at zero tension",
    looks_like="A length error over the tension that is curved, in proportion to the length.",
    confused_with=(
        "cable-elongation-linear",
        "cable-elongation-exponential",
        "cell-nonlinearity",
    ),
    told_apart="At least four loads over the whole range; the torque shows a curved cell.",
    family="cable law",
    contains=("cable-elongation-linear",),
    needs=("cable_force",),
    probes=({"k1": 2e5}, {"k1": 2e5, "b2": 100.0}, {"k1": 2e5, "b3": 3e4}),
    on_robot=frozenset({"all"}),
)
