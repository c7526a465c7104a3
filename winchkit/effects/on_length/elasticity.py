"""Elastic elongation of the cable, by three laws, and of the frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyval

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage


def _cable_elongation_linear(length: Array, at: At, values: Values) -> Array:
    return length + at.stressed_length * at.tension / values["axial_stiffness"]


CABLE_ELONGATION_LINEAR = Effect(
    id="cable-elongation-linear",
    stage=Stage.CABLE,
    parameters=(
        Parameter(
            "axial_stiffness",
            "N",
            null=np.inf,
            typical=2e5,
            low=1e3,
            high=np.inf,
            reciprocal=True,
            plausible=Plausible(5000.0, float("inf"), "a fibre cable of 1 mm has 10 kN"),
        ),
    ),
    apply=_cable_elongation_linear,
    outputs=("cable_length",),
    variable="load",
    what="The cable is elastic: it stretches by its strain times its stressed length.",
    formula="ℓ + ℓ_s T / EA, ℓ_s = ℓ + dead length",
    source="Hooke; IPAnema 3 paper, Eq. 4; steel EA = 50–105 GPa × fill × area",
    looks_like="A length error in proportion to tension times length.",
    confused_with=("frame-compliance", "cable-elongation-quartic", "cable-elongation-exponential"),
    told_apart="The same load at several lengths; several loads over the full stroke.",
    family="cable law",
    needs=("cable_force",),
    on_robot=frozenset({"one", "all"}),
)


def _cable_elongation_exponential(length: Array, at: At, values: Values) -> Array:
    """Length with the strain k ln(1 + T/F0); a slack cable has none."""
    tight = np.log1p(np.maximum(at.tension, 0.0) / values["force_scale"])
    return length + at.stressed_length * values["strain_scale"] * tight


CABLE_ELONGATION_EXPONENTIAL = Effect(
    id="cable-elongation-exponential",
    stage=Stage.CABLE,
    parameters=(
        Parameter("strain_scale", "1", null=0.0, typical=1e-3, low=0.0, high=0.2),
        Parameter(
            "force_scale",
            "N",
            null=200.0,
            typical=200.0,
            low=1.0,
            high=1e6,
            role="shape",
            grid=(30.0, 100.0, 300.0, 1e3, 3e3),
        ),
    ),
    apply=_cable_elongation_exponential,
    outputs=("cable_length",),
    variable="load",
    reduces_to=("cable-elongation-linear",),
    what="The cable's stiffness grows in proportion to its tension.",
    formula="ℓ + ℓ_s k ln(1 + T/F0), hence T = F0 (exp(ε/k) − 1)",
    source="IPAnema 3 paper, Eq. 6, re-based to zero strain at zero tension",
    looks_like="Large strain at low tension, little more at high tension.",
    confused_with=(
        "cable-elongation-linear",
        "cable-elongation-quartic",
        "cell-nonlinearity",
    ),
    told_apart="At least four loads, the lowest near slack.",
    family="cable law",
    contains=("cable-elongation-linear",),
    needs=("cable_force",),
    on_robot=frozenset({"all"}),
)

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


def _cable_elongation_quartic(length: Array, at: At, values: Values) -> Array:
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


CABLE_ELONGATION_QUARTIC = Effect(
    id="cable-elongation-quartic",
    stage=Stage.CABLE,
    parameters=(
        Parameter("k1", "N", null=np.inf, typical=2e5, low=1e3, high=np.inf, reciprocal=True),
        Parameter("b2", "1", null=0.0, typical=100.0, low=-1e4, high=1e5, role="shape"),
        Parameter("b3", "1", null=0.0, typical=3e4, low=-1e7, high=1e8, role="shape"),
        Parameter("b4", "1", null=0.0, typical=1e7, low=-1e10, high=1e11, role="shape"),
    ),
    apply=_cable_elongation_quartic,
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


def _frame_compliance(length: Array, at: At, values: Values) -> Array:
    return length + at.tension / values["stiffness"]


FRAME_COMPLIANCE = Effect(
    id="frame-compliance",
    stage=Stage.FRAME,
    parameters=(
        Parameter(
            "stiffness",
            "N/m",
            null=np.inf,
            typical=2e5,
            low=100.0,
            high=np.inf,
            reciprocal=True,
            plausible=Plausible(
                1000.0, float("inf"), "a frame that gives by 1 mm under 1 N is not fixed"
            ),
        ),
    ),
    apply=_frame_compliance,
    outputs=("cable_length",),
    variable="load",
    what="Mast, pulley brackets and exit point deflect towards the load.",
    formula="ℓ + T/k",
    source="Hooke",
    looks_like="A length error in proportion to the tension, the same at every length.",
    confused_with=("cable-elongation-linear",),
    told_apart="The same load at several lengths; several loads over the full stroke.",
    needs=("cable_force",),
    on_robot=frozenset({"one", "all"}),
)
