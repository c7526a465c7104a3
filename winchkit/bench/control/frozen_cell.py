"""Detects a frozen load cell: a sequential likelihood-ratio test on its raw counts.

A frozen cell repeats its count exactly. A live one repeats it by chance, in each conversion with
a probability of at most p. The log-likelihood ratio of "frozen" against "live" is therefore at
least the sum of -ln p over the repeats since the last change; a change refutes "frozen" and sets
the sum to zero (Wald's sequential test with restarts: A. Wald, Sequential Analysis, 1947;
E. S. Page, Continuous inspection schemes, Biometrika 41, 1954). Two bounds p are used, each with
the count's own step as the unit:

noise
    Gaussian noise of standard deviation s stays within one step with p <= erf(1 / (2 sqrt(2) s)),
    wherever in the step its mean is. A lower bound of s comes from the history at rest: two counts
    in a row differ by more than m steps with a probability of at most erfc(m / (2 s)). A cell
    whose count rests for long by nature has s = 0 and p = 1.
predicted change
    Where the tension was to change by D steps while the count stood still, of which a wrong
    profile takes a fifth and quantisation one step, a live cell repeats its count only if its noise
    makes up for 0.8 |D| - 1 in each conversion: p <= Q((0.8 |D| - 1) / s - 6.07), an upper
    bound of s here; the noise of the count at which the run began is beyond 6.07 s with 6e-10.

The threshold -ln(1e-9), higher for cells above 278 conversions per second, keeps false trips
below one in 1000 h; see tests/bench/control/test_frozen_cell.py and benchmarks/frozen_cell.py.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import erfc, exp, inf, isfinite, log, nan, pi, sqrt
from statistics import NormalDist, median

from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.units import GRAVITY

_CONFIDENCE = 1e-9
"""Probability of a live cell that a run of repeats as long as the one that trips begins."""
_HOURS = 1000 * 3600.0
"""s: one false alarm in 1000 hours of readings at most."""
_BLOCK, _BLOCKS = 200, 10
"""Conversions at rest of one estimate of the noise, and number of estimates that are kept."""
_BY_STEPS = (1, 2, 4, 8, 16, 32)
_COMMON = 0.02
"""Differences that are rarer say nothing about the usual noise: hits, switching."""
_Z = 2.0
"""Of the Wilson interval around the share of differences, standard deviations."""
_LONGER = 1.5
"""Times the longest run of repeats that ended by itself."""
_FEWEST = 20
"""Conversions at rest before a predicted change counts."""
_SURPRISE = 1e-3
"""With at least this probability a live cell would have been as quiet as it was."""
_WIDER, _LEAST = 1.3, 0.05
"""Factor and least value of the upper bound of the noise, the latter in steps."""
_WRONG = 0.2
"""Share of a predicted change that a wrong profile makes up."""
_BEGUN = 6.07
"""In s (see above): the normal distribution is beyond it with 6e-10, one run of equal counts in
1.6e9."""
_NORMAL = NormalDist()
_KEPT, _SPACING = 1.0, 5e-3
"""Span of the predictions that are kept, and their least distance, s."""
_SETTLING = 0.05
"""Tolerance of a prediction in time, s: lag of drive, cable and amplifier."""
_UNSTABLE = 5.0
"""At rest for so long, s, a load has ceased to swing and an amplifier to settle."""
_NOISIER = 5.0
"""Times the usual noise, and at least so many steps."""
_CALM = 1.0
"""At rest for so long before noise is learned, s: the load swings after a motion."""
_WINDOW = 0.04
"""Time over which accelerations are averaged, s."""
_SAME = 0.999
"""Share of a step below which a difference is a finer step and not rounding."""
_KEEPS_COUNTING = Quality.DUPLICATE | Quality.LATE | Quality.UNSTABLE | Quality.FROZEN


@dataclass(frozen=True, slots=True)
class Frozen:
    """A finding: the cell's count is constant for longer than chance allows."""

    count: float
    duration: float
    """Time since the last change of the count, s."""
    conversions: float
    predicted: float
    """Change of the tension in that time by the prediction, N; NaN without one."""

    def __str__(self) -> str:
        change = f" while the tension was to change by {self.predicted:.3g} N"
        return (
            f"the load cell is frozen: its raw count {self.count:g} has stood still for "
            f"{self.duration:.2f} s ({self.conversions:.0f} conversions)"
            f"{change if abs(self.predicted) > 0 else ', which its noise never does'}; switch the "
            "amplifier off and on, then reset"
        )


@dataclass(slots=True)
class _Noise:
    """Bounds of the noise of a cell at rest, in steps."""

    low: deque[float] = field(default_factory=lambda: deque(maxlen=_BLOCKS))
    high: deque[float] = field(default_factory=lambda: deque(maxlen=_BLOCKS))
    longest: float = 0.0
    """Repeats in a row that ended by themselves."""
    _pairs: int = 0
    _beyond: dict[int, int] = field(default_factory=lambda: dict.fromkeys(_BY_STEPS, 0))
    trials: float = 0.0
    """Conversions of the block that is under way."""
    _sum: float = 0.0
    _squares: float = 0.0
    _origin: float = nan

    def learn(self, change: float, run: float, steps: float) -> None:
        """Take in a change (steps) after a run of repeats at a count (steps)."""
        if not isfinite(self._origin):
            self._origin = steps
        offset = steps - self._origin
        self._pairs += 1 + round(run)
        self.trials += 1 + run
        self._sum += (1 + run) * offset
        self._squares += (1 + run) * offset * offset
        for many in _BY_STEPS:
            self._beyond[many] += abs(change) > many + 0.5
        if self.trials >= _BLOCK:
            self._close()

    def rescale(self, factor: float) -> None:
        """The steps turned out to be finer by a factor."""
        for bounds in (self.low, self.high):
            for at, bound in enumerate(bounds):
                bounds[at] = bound * factor
        self._restart()

    def _close(self) -> None:
        self.low.append(max(self._at_least(many) for many in _BY_STEPS))
        self.high.append(self.spread())
        self._restart()

    def spread(self) -> float:
        """Standard deviation of the block that is under way, in steps."""
        mean = self._sum / self.trials
        return sqrt(max(0.0, self._squares / self.trials - mean * mean))

    def _restart(self) -> None:
        self._pairs, self.trials, self._sum, self._squares = 0, 0.0, 0.0, 0.0
        self._beyond = dict.fromkeys(_BY_STEPS, 0)
        self._origin = nan

    def _at_least(self, many: int) -> float:
        """Noise below which so many differences of more than ``many`` steps cannot be."""
        n, share = self._pairs, self._beyond[many] / self._pairs
        middle = share + _Z * _Z / (2 * n)
        spread = _Z * sqrt(share * (1 - share) / n + _Z * _Z / (4 * n * n))
        low = (middle - spread) / (1 + _Z * _Z / n)
        return 0.0 if low < _COMMON else many / (-sqrt(2) * _NORMAL.inv_cdf(low / 2))


class FrozenCell:
    """The test for one cell; for one thread. Fed in each control cycle with :meth:`update`."""

    def __init__(self, rate: float, *, correlation: float = 0.0, per_count: float = nan) -> None:
        """Take conversions a second, the noise's correlation time (s), and N per count, or NaN."""
        self.finding: Frozen | None = None
        self._rate = rate
        self._independent = max(1 / rate, correlation)
        self._threshold = -log(min(_CONFIDENCE, 1 / (_HOURS * rate)))
        self._per_count = per_count
        self._step = nan
        self._noise = _Noise()
        self._predictions: deque[tuple[float, float]] = deque()
        self._last: InstrumentReading | None = None
        self._start: InstrumentReading | None = None
        self._expected: tuple[float, float] | None = None
        """Least of the upper and largest of the lower ends of the predictions of the run, N."""
        self._stopped = nan
        self._noisy = ""
        self._run = self._sum = self._rest = 0.0

    @property
    def unstable(self) -> str:
        """Why the readings at rest are not as steady as they were, in words; empty if they are."""
        last = self._last
        if last is not None and last.quality & Quality.UNSTABLE and isfinite(self._stopped):
            rested = last.t_receive - self._stopped > _UNSTABLE
            return f"its device says so {_UNSTABLE:g} s after a motion" if rested else ""
        return self._noisy

    def update(
        self, reading: InstrumentReading | None, now: float, predicted: float = nan, *, moving: bool
    ) -> Frozen | None:
        """The finding in this cycle, if any.

        ``reading`` is the cell's newest, ``predicted`` the tension (N) that the model has now, NaN
        for none; only its changes count. ``moving`` says whether the winch is enabled: noise is
        learned while it is not.
        """
        kept = self._predictions
        if not kept or now - kept[-1][0] >= _SPACING:
            kept.append((now, predicted))
            if now - kept[0][0] > _KEPT:
                kept.popleft()
        if moving:
            self._stopped = nan
        elif not isfinite(self._stopped):
            self._stopped = now
        last = self._last
        if reading is not None and (last is None or reading.t_receive > last.t_receive):
            self._last = reading
            self._take(reading, last, now - self._stopped > _CALM)
        return self.finding

    def _take(self, reading: InstrumentReading, last: InstrumentReading | None, calm: bool) -> None:
        known = isfinite(reading.raw) and not reading.quality & ~_KEEPS_COUNTING
        if not known or last is None or self._start is None:
            self._begin(reading if known else None)
            return
        trial = min(1.0, (reading.t_receive - last.t_receive) * self._rate)
        if reading.raw != last.raw:
            self._changed(reading, last, calm)
            return
        self._run += trial
        self._rest += trial if calm else 0.0
        since = reading.t_receive - last.t_receive
        predicted, drift = self._drift(reading)
        noise = trial * self._quiet() if self._run > _LONGER * self._noise.longest else 0.0
        self._sum += max(noise, drift * min(1.0, since / self._independent))
        if self._sum >= self._threshold:
            duration = reading.t_receive - self._start.t_receive
            self.finding = Frozen(reading.raw, duration, self._run, predicted if drift else nan)

    def _begin(self, reading: InstrumentReading | None) -> None:
        self._start, self.finding = reading, None
        self._run = self._sum = self._rest = 0.0
        self._expected = None
        if reading is not None and not isfinite(self._step):
            self._step = _divisor(reading.raw)

    def _changed(self, reading: InstrumentReading, last: InstrumentReading, calm: bool) -> None:
        change = abs(reading.raw - last.raw)
        if not change > _SAME * self._step:
            self._noise.rescale(self._step / change)
            self._step = change
        shown = reading.value - last.value
        if isfinite(shown) and shown:
            self._per_count = abs(shown) / change
        if calm:
            self._noise.learn(change / self._step, self._run, last.raw / self._step)
            self._noisy = self._compared()
        self._noise.longest = max(self._noise.longest, self._run)
        self._begin(reading)

    def _compared(self) -> str:
        """The noise where it is far above its history, in words."""
        noise = self._noise.high
        if len(noise) < _BLOCKS // 2 or noise[-1] <= _NOISIER * max(median(noise), 1.0):
            return ""
        unit = self._per_count * self._step
        return (
            f"noise at rest of {noise[-1] * unit:.2g} N, so far {median(noise) * unit:.2g} N; "
            "check cable and shield, and what makes the load oscillate"
        )

    def _quiet(self) -> float:
        """-ln p of a repeat by the noise alone."""
        low = min(self._noise.low, default=0.0)
        return -log(1 - erfc(0.5 / (sqrt(2) * low))) if low > 0 else 0.0

    def _drift(self, reading: InstrumentReading) -> tuple[float, float]:
        """Predicted change since the last one of the count (N), and -ln p of a repeat by it."""
        high, start = self._highest(), self._start
        if start is None or reading.t_sample < start.t_receive + 2 * _SETTLING:
            return nan, 0.0
        if self._expected is None:
            self._expect(*self._range(start, later=True))
        low, top = self._range(reading)
        self._expect(low, top)
        if self._expected is None or not all(map(isfinite, (high, self._per_count, self._step))):
            return nan, 0.0
        # The smallest change between what may have been in force at two readings of the run.
        least, most = self._expected
        change = max(low - least, most - top, 0.0)
        if most - top > low - least:
            change = -change
        steps = abs(change) / (self._per_count * self._step)
        beyond = ((1 - _WRONG) * steps - 1) / high - _BEGUN
        return change, -_log_tail(beyond) if beyond > 0 else 0.0

    def _highest(self) -> float:
        """Upper bound of the noise, steps; infinite while too little is known."""
        if self._noise.high:
            return max(_LEAST, _WIDER * median(self._noise.high))
        if self._noise.trials >= _FEWEST:
            return max(_LEAST, 2 * _WIDER * self._noise.spread())
        quiet = max(self._rest, self._noise.longest)
        if quiet < _FEWEST:
            return inf
        stays = exp(log(_SURPRISE) / quiet)
        return max(_LEAST, 0.5 / _NORMAL.inv_cdf((1 + stays) / 2))

    def _expect(self, low: float, top: float) -> None:
        """Take a reading's range of predictions into those of the run."""
        if isfinite(low) and isfinite(top):
            least, most = self._expected or (inf, -inf)
            self._expected = (min(least, top), max(most, low))

    def _range(self, reading: InstrumentReading, *, later: bool = False) -> tuple[float, float]:
        """Least and largest prediction that may have been in force at a reading."""
        begin = reading.t_sample - reading.t_uncertainty - _SETTLING
        end = reading.t_sample + reading.t_uncertainty + _SETTLING * later
        low, top = inf, -inf
        for time, tension in reversed(self._predictions):
            if time <= end:
                low, top = min(low, tension), max(top, tension)
                if time <= begin:
                    break
        return (low, top) if low <= top else (nan, nan)


class PredictedTension:
    """Predicted tension of a cable that a known mass hangs on: m (g + a)."""

    def __init__(self, mass: float) -> None:
        """``mass`` in kg; NaN for an unknown one, which predicts nothing."""
        self._mass = mass
        self._speeds: deque[tuple[float, float, float]] = deque()

    def tension(self, now: float, commanded: float, measured: float) -> float:
        """The tension (N) at winding speeds (m/s) of a cycle.

        The acceleration is the smaller of the commanded and the measured one: a drive that does not
        follow changes no tension, and the noise of a measured speed is none either.
        """
        speeds = self._speeds
        speeds.append((now, commanded, measured))
        while now - speeds[0][0] > _WINDOW:
            speeds.popleft()
        time, first, seen = speeds[0]
        if now - time < _WINDOW / 2:
            return self._mass * GRAVITY
        wanted, done = (commanded - first) / (now - time), (measured - seen) / (now - time)
        acceleration = min(wanted, done, key=abs) if wanted * done > 0 else 0.0
        return self._mass * (GRAVITY + acceleration)


def _divisor(raw: float) -> float:
    """Largest step 1, 2 or 5 times a power of ten that a display with this count may have."""
    if raw == 0 or not isfinite(raw):
        return nan
    digits = f"{abs(raw):.9f}".rstrip("0").rstrip(".")
    places = len(digits.partition(".")[2])
    whole, unit = round(abs(raw) * 10**places), 10.0**-places
    while whole % 10 == 0:
        whole, unit = whole // 10, unit * 10
    return unit * (5 if whole % 5 == 0 else 2 if whole % 2 == 0 else 1)


def _log_tail(z: float) -> float:
    """ln of the upper tail of the normal distribution, for z >= 0."""
    if z < 25:
        return log(erfc(z / sqrt(2)) / 2)
    return -z * z / 2 - log(z * sqrt(2 * pi))
