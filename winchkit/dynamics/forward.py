"""Simulated runs of a profile: motion, tension and length under a torque or a reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from winchkit.arguments import number, positive, require_type
from winchkit.arrays import Array
from winchkit.dynamics.balance import Balance, balance, refuse_load
from winchkit.dynamics.drives import RECORDED, Inputs, cascade
from winchkit.dynamics.integration import Integrator, SimulatedMotion, holding_torque
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.term import Term, act, modifiers_of
from winchkit.errors import Fault, RunError, UsageError
from winchkit.model.line import Line
from winchkit.model.line import Motion as LineMotion
from winchkit.model.stages import Signals
from winchkit.model.trajectory import JERK_TIME, plan
from winchkit.runs.gaps import lost_samples
from winchkit.runs.linear_axis import rotary_runs
from winchkit.runs.run import Channel, Run
from winchkit.schema.linear_axis import CHANNELS, UNITS
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.programme import ALL, Programme
from winchkit.units import GRAVITY

_COARSEST = 0.01
"""Relative error of a step beyond which a simulation is none; numerical."""
_REFERENCE_STEP = 1e-3
"""s: between the points of a reference, whose acceleration builds up in 0.3 s in a programme."""
_TEMPERATURE = 20.0
"""°C: at which every thermal effect is zero."""
GOAL = "reference_angle"
"""Channel with the reference that a drive followed, rad, or m on a linear axis."""
_BRIDGED = 0.1
"""s: of missing values between two others over which an input is a straight line, as it is between
its samples; some cycles of a bus that lost them (rule of thumb)."""
_NEWTON_STEPS = 4
"""As of :mod:`winchkit.model.line`."""


def forward(
    profile: WinchProfile,
    *,
    programme: Programme | None = None,
    torque: Run | None = None,
    reference: Run | None = None,
    catalogue: Catalogue | None = None,
    load_mass: float | None = None,
    initial_speed: float | None = None,
    rate: float = 100.0,
    tolerance: float = 1e-8,
) -> Run:
    """Simulate the motion of a profile with its effects.

    Parameters
    ----------
    profile : WinchProfile
        The winch or the axis.
    programme : Programme, optional
        Motion programme of a winch, whose cable lengths the loops of ``profile.control`` follow:
        one repeat under one load, from rest.
    torque : Run, optional
        Run whose motor torque drives the motor, open loop.
    reference : Run, optional
        Run whose channel ``reference_angle``, else motor angle, the loops of ``profile.control``
        follow.
    catalogue : Catalogue, optional
        Effects; by default all that are installed.
    load_mass : float, optional
        Mass on the cable, kg; by default that of the run or the programme.
    initial_speed : float, optional
        Of the motor, rad/s, or of a linear axis, m/s; by default that of the run.
    rate : float
        Samples of a programme per second, Hz; a run is simulated at its own times.
    tolerance : float
        Relative error of a step of the integration, at most 0.01.

    Returns
    -------
    Run
        Motor angle, velocity and torque, of a winch cable length, and load and tension where it has
        a load; of a linear axis position, velocity and force. Without noise.

    Raises
    ------
    UsageError
        For none or several of the three sources, effects without a step, a profile without inertia
        or without gains, a programme of several winches, and a cable that becomes slack or ends.
    RunError
        For a run without torque or initial speed, or with missing values.

    Notes
    -----
    The torque that the line predicts of a motion is solved for the acceleration (the balance of
    torques), and integrated with an event at every reversal, release and impact. A load moves with
    the unstrained cable, as in the prediction.
    """
    require_type(profile, WinchProfile, "profile")
    tolerance = positive("forward", "tolerance", tolerance, _COARSEST)
    terms = terms_of(profile, catalogue)
    if initial_speed is not None:
        initial_speed = number("forward", "initial_speed", initial_speed)
    if load_mass is not None:
        load_mass = positive("forward", "load_mass", load_mass)
        refuse_load(profile, terms, load_mass)
    sources = {"programme": programme, "torque": torque, "reference": reference}
    given = [name for name, source in sources.items() if source is not None]
    if len(given) != 1:
        had = " and ".join(given) or "none"
        raise UsageError(f"give one of a programme, a torque and a reference; there is {had}")
    if programme is not None:
        if initial_speed is not None:
            raise UsageError("a programme starts from rest: leave the initial speed out")
        setup = _of_programme(profile, terms, programme, load_mass, rate)
    else:
        run = torque if torque is not None else reference
        assert run is not None
        setup = setup_of(profile, run, load_mass, initial_speed, is_torque=torque is not None)
    return simulated(profile, terms, setup, tolerance)


@dataclass(frozen=True)
class Setup:
    """Times, initial state, load and drive of one simulation; SI, arrays (n,)."""

    name: str
    time: Array
    angle: float
    speed: float
    inputs: Inputs
    """``torque`` of the motor as its drive reports it, or ``goal`` and ``goal_speed`` of the loops;
    ``load`` where it is measured."""
    load_mass: float | None = None

    @property
    def has_load(self) -> bool:
        """Whether the cable carries a known load."""
        return self.load_mass is not None or "load" in self.inputs.signals


def simulated(
    profile: WinchProfile, terms: Sequence[Term], setup: Setup, tolerance: float = 1e-8
) -> Run:
    """The run of a setup; raises UsageError as :func:`forward`."""
    motion = motion_of(profile, terms, setup, tolerance)
    channels = _readings(profile, terms, setup, motion)
    if profile.is_linear:
        channels = {
            CHANNELS[name]: replace(channel, unit=UNITS[channel.unit])
            for name, channel in channels.items()
            if name in CHANNELS
        }
    metadata = {"simulated": f"forward dynamics of the profile {profile.name}"}
    if setup.load_mass is not None:
        metadata["load_mass"] = f"{setup.load_mass:g} kg"
    return Run(setup.name, motion.time, channels, metadata)


def law_of(profile: WinchProfile, terms: Sequence[Term], setup: Setup) -> Balance:
    """The balance under the load of a setup."""
    return balance(profile, terms, setup.load_mass, is_load_known="load" in setup.inputs.signals)


def motion_of(
    profile: WinchProfile,
    terms: Sequence[Term],
    setup: Setup,
    tolerance: float = 1e-8,
    law: Balance | None = None,
) -> SimulatedMotion:
    """The motion of a setup, without the readings of the instruments; with the balance of its
    profile, terms and load where it is known already."""
    law = law or law_of(profile, terms, setup)
    drive, inputs = RECORDED, setup.inputs
    if "torque" in inputs.signals:
        made = inputs.signals["torque"]
        for term in reversed(terms):
            if term.effect.undo is not None:
                made = term.effect.undo(made, inputs.time, term.values)
        inputs = replace(inputs, signals={**inputs.signals, "torque": made})
    elif profile.control is None:
        raise UsageError(
            f"profile '{profile.name}' has no gains, so that no loop can follow a reference: add "
            'the table [control] with position_gain = "25 1/s" and velocity_gain = "0.02 '
            + ('N s/m"' if profile.is_linear else 'N m s"')
        )
    else:
        drive = cascade(profile.control, holding_torque(law, inputs, setup.angle))
    return Integrator(law, drive, inputs, tolerance).run(setup.time, setup.angle, setup.speed)


def setup_of(
    profile: WinchProfile,
    run: Run,
    load_mass: float | None,
    initial_speed: float | None,
    *,
    is_torque: bool,
) -> Setup:
    """The setup of a run whose torque drives the motor, or whose motion the loops follow; raises
    RunError as :func:`forward`."""
    require_type(run, Run, "torque" if is_torque else "reference")
    run = driving_part(run, profile, is_torque=is_torque)
    time = run.time
    driving = _driving(run, is_torque=is_torque)
    values, speed = run[driving], initial_speed
    if speed is None and "motor_velocity" in run:
        speed = float(run["motor_velocity"][0])
    if speed is None and not is_torque:
        speed = float((values[1] - values[0]) / (time[1] - time[0]))
    if speed is None:
        unit = "m/s" if profile.is_linear else "rad/s"
        message = (
            "gives no initial speed, on which the motion depends: it has no "
            f"{'velocity' if profile.is_linear else 'motor_velocity'}; give --initial-speed, such "
            f"as '0 {unit}' for a start at rest"
        )
        raise RunError(Fault(message, run.path or run.name))
    angle = profile.reference.motor_angle
    if "motor_angle" in run:
        angle = float(run["motor_angle"][0])
    mass, signals = load_mass if load_mass is not None else run.load_mass, {}
    if mass is None and "load" in run and not isinstance(profile, AxisProfile):
        signals["load"] = run["load"]
    if is_torque:
        signals["torque"] = values
        return Setup(f"{run.name}-forward", time, angle, speed, Inputs(time, signals), mass)
    is_measured = driving == "motor_angle" and "motor_velocity" in run
    path = CubicHermiteSpline(
        time, values, run["motor_velocity"] if is_measured else np.gradient(values, time)
    )
    # A straight path between coarse samples would fall behind its own speed in each of them.
    fine = np.linspace(time[0], time[-1], max(2, round(np.ptp(time) / _REFERENCE_STEP) + 1))
    signals = {name: np.interp(fine, time, given) for name, given in signals.items()}
    signals |= {"goal": path(fine), "goal_speed": path(fine, 1)}
    return Setup(f"{run.name}-forward", time, angle, speed, Inputs(fine, signals), mass)


def driving_part(run: Run, profile: WinchProfile, *, is_torque: bool) -> Run:
    """The part of a run with what drives a simulation, in the channels of the model, from the first
    to the last sample at which all is known; short gaps are straight lines. Raises RunError for
    fewer than two samples and for a longer gap."""
    (run,) = rotary_runs([run], is_linear_axis=profile.is_linear)
    if "predicted_torque" in run:
        message = (
            "has the torque of another model, which is known along the measured motion only: no "
            "other motion can be simulated with it; leave that column out"
        )
        raise RunError(Fault(message, run.path or run.name))
    used = {_driving(run, is_torque=is_torque), "motor_angle", "motor_velocity"}
    if not isinstance(profile, AxisProfile) and run.load_mass is None:
        used.add("load")
    own = {name: run[name] for name in sorted(used) if name in run}
    run[_driving(run, is_torque=is_torque)]  # Raises without it.
    known = np.all([np.isfinite(values) for values in own.values()], axis=0)
    rows = np.flatnonzero(known)
    place = run.path or run.name
    if len(rows) < 2:
        message = (
            f"{', '.join(own)}: {len(rows)} samples with a value in each; a simulation needs two "
            "at least"
        )
        raise RunError(Fault(message, place))
    kept = slice(rows[0], rows[-1] + 1)
    time, faults = run.time[kept], list[Fault]()
    channels = {
        name: replace(channel, values=channel.values[kept])
        for name, channel in run.channels.items()
    }
    for name, whole in own.items():
        values = whole[kept]
        there = np.flatnonzero(np.isfinite(values))
        gaps = np.where(lost_samples(time[there]), np.diff(time[there]), 0.0)
        longest = int(np.argmax(gaps))
        if gaps[longest] > _BRIDGED:
            message = (
                f"{name}: no value for {gaps[longest]:.3g} s from {time[there[longest]]:.4g} s "
                f"on, above the {_BRIDGED:g} s that a straight line bridges; cut the run there"
            )
            faults.append(Fault(message, place))
        bridged = np.interp(time, time[there], values[there])
        channels[name] = replace(channels[name], values=bridged)
    if faults:
        raise RunError(faults)
    return replace(run, time=time, channels=channels)


def _driving(run: Run, *, is_torque: bool) -> str:
    """Channel that drives a simulation."""
    return "motor_torque" if is_torque else GOAL if GOAL in run else "motor_angle"


def _of_programme(
    profile: WinchProfile,
    terms: Sequence[Term],
    programme: Programme,
    load_mass: float | None,
    rate: float,
) -> Setup:
    """One repeat of a programme's moves, under the first load that it asks for."""
    require_type(programme, Programme, "programme")
    if isinstance(profile, AxisProfile):
        raise UsageError(
            f"profile '{profile.name}' is an axis, and a motion programme has cable lengths: give "
            "--reference RUN with the motor angles to follow"
        )
    winches = sorted({step.winch for step in programme.step} - {ALL})
    if len(winches) > 1:
        raise UsageError(
            f"programme '{programme.name}' moves {', '.join(winches)}, and one winch is simulated: "
            "leave the steps of the others out"
        )
    if not 0.0 < rate <= 1 / _REFERENCE_STEP:
        raise UsageError(f"rate {rate:g} Hz must be above 0 and at most {1 / _REFERENCE_STEP:g} Hz")
    ends = programme.approach(*winches or [ALL])
    here = ends[-1] if ends else profile.reference.cable_length or 0.0
    mass = load_mass
    lengths, speeds = [np.array([here])], [np.zeros(1)]
    for place, step in enumerate(programme.step, start=1):
        if step.load_mass is not None:
            if mass is not None and load_mass is None and step.load_mass != mass:
                break
            mass = step.load_mass if load_mass is None else load_mass
        if step.ask is not None:
            continue
        goal = here + step.by if step.by is not None else step.to if step.to is not None else here
        if step.hold is not None:
            count = max(1, round(step.hold / _REFERENCE_STEP))
            gone, speed = np.zeros(count), np.zeros(count)
        elif step.acceleration is None:
            raise UsageError(
                f"programme '{programme.name}', step {place}: gives no acceleration, which a "
                'bench would limit; add acceleration = "0.8 m/s^2"'
            )
        else:
            ramp = step.acceleration
            move = plan(goal - here, step.speed or 0.0, ramp, ramp / JERK_TIME)
            count = max(1, round(move.duration / _REFERENCE_STEP))
            gone, speed, _ = move.at(np.linspace(0.0, move.duration, count + 1)[1:])
        lengths.append(here + gone)
        speeds.append(speed)
        here = goal
    length, paid_out = np.concatenate(lengths), np.concatenate(speeds)
    time = np.linspace(0.0, (len(length) - 1) * _REFERENCE_STEP, len(length))
    angle, arm = _angles(profile, terms, length, (mass or 0.0) * GRAVITY)
    every = np.arange(0.0, time[-1], 1 / rate)
    if len(every) < 2:
        raise UsageError(
            f"programme '{programme.name}' has no move and no hold under its first load, "
            f"from where it ends, {here:g} m"
        )
    inputs = Inputs(time, {"goal": angle, "goal_speed": -paid_out / arm})
    return Setup(f"{programme.name}-forward", every, float(angle[0]), 0.0, inputs, mass)


def _angles(
    profile: WinchProfile, terms: Sequence[Term], length: Array, weight: float
) -> tuple[Array, Array]:
    """Motor angles at cable lengths under a weight at rest, and cable per motor angle there."""
    line = Line(
        profile,
        modifiers_of(t for t in terms if not t.effect.not_in_control and not t.effect.memory),
    )
    angle = line.nominal_motor_angle(length)
    for _ in range(_NEWTON_STEPS):
        there, arm = line.lengths_and_arms(line.at_rest(angle, weight, _TEMPERATURE))
        angle = angle + (there - length) / arm
    return angle, arm


def _readings(
    profile: WinchProfile, terms: Sequence[Term], setup: Setup, motion: SimulatedMotion
) -> dict[str, Channel]:
    """Readings of the instruments along a motion, without noise."""
    torque = motion.torque
    for term in terms:
        if term.effect.undo is not None:
            torque = act(term.effect, term.values, torque, _at(profile, motion, torque).at)
    out = {
        "motor_angle": Channel(motion.angle, "rad"),
        "motor_velocity": Channel(motion.speed, "rad/s"),
        "motor_torque": Channel(torque, "N m"),
    }
    if isinstance(profile, AxisProfile):
        return out
    measured = _at(profile, motion, torque)
    line = Line(profile, modifiers_of(terms))
    predicted = line.predict(replace(measured, load=motion.load if setup.has_load else None))
    out["cable_length"] = Channel(predicted["cable_length"], "m")
    wound = np.flatnonzero(predicted["cable_length"] < 0.0)
    if len(wound) and profile.reference.cable_length is not None:
        raise UsageError(
            f"all of the cable is wound in at {motion.time[wound[0]]:.4g} s: its free length would "
            "be below 0 from there on; cut the run there, or check its torque and load"
        )
    if setup.has_load:
        out["load"] = Channel(motion.load, "N")
        out["tension"] = Channel(predicted["tension"], "N")
    return out


def _at(profile: WinchProfile, motion: SimulatedMotion, torque: Array) -> LineMotion:
    """Inputs of the modifiers along a simulated motion: its own derivatives and directions."""
    line = Line(profile)
    warm = np.full_like(motion.time, _TEMPERATURE)
    given = line.motion(
        Signals(motion.time, motion.angle, load=motion.load, temperature=warm, motor_torque=torque)
    )
    own = replace(
        given.at,
        motor_rate=motion.speed,
        motor_acceleration=motion.acceleration,
        motor_direction=motion.direction,
        direction=motion.direction * profile.gearbox.direction,
    )
    return replace(given, at=own)
