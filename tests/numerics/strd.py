"""Statistical Reference Datasets of NIST, with certified values; and a regression made of one.

Data and certified values: NIST StRD, https://www.itl.nist.gov/div898/strd/, a work of the United
States government and in the public domain. Of every set the name, the file's order and its digits
are kept. Linear sets: Longley (1967), Norris (NIST, unpublished), Wampler (1970), Filippelli
(NIST, unpublished). Nonlinear sets: Misra, Thurber, Eckerle (NIST), Kowalik and Osborne (1978, in
Moré, Garbow and Hillstrom 1981), Ratkowsky (1983).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.time_series import Problem

__all__ = ["LINEAR", "NONLINEAR", "Curve", "Dataset", "digits", "regression_of", "start_of"]


@dataclass(frozen=True)
class Dataset:
    """One reference data set: y = model(x, b) + e."""

    name: str
    x: Array
    """(n,) or (n, predictors)."""
    y: Array
    """(n,)."""
    model: Callable[[Array, Array], Array]
    certified: tuple[float, ...]
    """Certified parameters."""
    squares: float
    """Certified residual sum of squares."""
    starts: tuple[tuple[float, ...], ...] = ()
    """The two starting points that are part of the standard, far and near."""

    @property
    def deviation(self) -> float:
        """Certified residual standard deviation; 1 where the fit is exact."""
        free = len(self.y) - len(self.certified)
        return float(np.sqrt(self.squares / free)) or 1.0


class Curve:
    """The members of a regression problem that a fit uses, for a data set."""

    def __init__(self, data: Dataset) -> None:
        self._data = data

    def vector(self, hypothesis: Hypothesis) -> Array:
        return np.array(hypothesis.nuisances)

    def hypothesis(self, vector: Array, like: Hypothesis) -> Hypothesis:
        return Hypothesis(nuisances=tuple(vector.tolist()))

    def bounds(self, like: Hypothesis) -> tuple[Array, Array]:
        free = np.full(len(like.nuisances), np.inf)
        return -free, free

    def residual(self, hypothesis: Hypothesis) -> Array:
        with np.errstate(over="ignore"):
            return self._data.y - self._data.model(self._data.x, self.vector(hypothesis))

    def jacobian(self, vector: Array, like: Hypothesis) -> Array:
        """Derivatives of the model by complex steps, exact to rounding; (n, parameters)."""
        columns = []
        for index in range(len(vector)):
            moved = vector.astype(complex)
            moved[index] += 1e-30j
            with np.errstate(over="ignore"):
                columns.append(np.imag(self._data.model(self._data.x, moved)) / 1e-30)
        return np.array(columns).T


def regression_of(data: Dataset) -> Problem:
    """The data set as a regression problem."""
    return cast(Problem, Curve(data))


def start_of(vector: tuple[float, ...]) -> Hypothesis:
    """A model specification at a point."""
    return Hypothesis(nuisances=vector)


def digits(found: Array, certified: tuple[float, ...]) -> float:
    """Log relative error: correct significant digits of the worst parameter (McCullough 1998)."""
    wanted = np.array(certified)
    wrong = np.abs(found - wanted) / np.abs(wanted)
    return float(-np.log10(max(float(wrong.max()), 1e-15)))


def _product(x: Array, b: Array) -> Array:
    return x @ b


def _powers(x: Array, degree: int) -> Array:
    return np.asarray(np.vander(x, degree + 1, increasing=True))


def _table(text: str) -> Array:
    return np.array([[float(word) for word in line.split()] for line in text.strip().splitlines()])


_NORRIS = _table("""
0.1 0.2
338.8 337.4
118.1 118.2
888.0 884.6
9.2 10.1
228.1 226.5
668.5 666.3
998.5 996.3
449.1 448.6
778.9 777.0
559.2 558.2
0.3 0.4
0.1 0.6
778.1 775.5
668.8 666.9
339.3 338.0
448.9 447.5
10.8 11.6
557.7 556.0
228.3 228.1
998.0 995.8
888.8 887.6
119.6 120.2
0.3 0.3
0.6 0.3
557.6 556.8
339.3 339.1
888.0 887.2
998.5 999.0
778.9 779.0
10.2 11.1
117.6 118.3
228.9 229.2
668.4 669.1
449.2 448.9
0.2 0.5
""")
_LONGLEY = _table("""
60323 83.0 234289 2356 1590 107608 1947
61122 88.5 259426 2325 1456 108632 1948
60171 88.2 258054 3682 1616 109773 1949
61187 89.5 284599 3351 1650 110929 1950
63221 96.2 328975 2099 3099 112075 1951
63639 98.1 346999 1932 3594 113270 1952
64989 99.0 365385 1870 3547 115094 1953
63761 100.0 363112 3578 3350 116219 1954
66019 101.2 397469 2904 3048 117388 1955
67857 104.6 419180 2822 2857 118734 1956
68169 108.4 442769 2936 2798 120445 1957
66513 110.8 444546 4681 2637 121950 1958
68655 112.6 482704 3813 2552 123366 1959
69564 114.2 502601 3931 2514 125368 1960
69331 115.7 518173 4806 2572 127852 1961
70551 116.9 554894 4007 2827 130081 1962
""")
_FILIP_X = _table("""
-6.860120914 -4.324130045 -4.358625055 -4.358426747 -6.955852379 -6.661145254 -6.355462942
-6.118102026 -7.115148017 -6.815308569 -6.519993057 -6.204119983 -5.853871964 -6.109523091
-5.79832982 -5.482672118 -5.171791386 -4.851705903 -4.517126416 -4.143573228 -3.709075441
-3.499489089 -6.300769497 -5.953504836 -5.642065153 -5.031376979 -4.680685696 -4.329846955
-3.928486195 -8.56735134 -8.363211311 -8.107682739 -7.823908741 -7.522878745 -7.218819279
-6.920818754 -6.628932138 -6.323946875 -5.991399828 -8.781464495 -8.663140179 -8.473531488
-8.247337057 -7.971428747 -7.676129393 -7.352812702 -7.072065318 -6.774174009 -6.478861916
-6.159517513 -6.835647144 -6.53165267 -6.224098421 -5.910094889 -5.598599459 -5.290645224
-4.974284616 -4.64454848 -4.290560426 -3.885055584 -3.408378962 -3.13200249 -8.726767166
-8.66695597 -8.511026475 -8.165388579 -7.886056648 -7.588043762 -7.283412422 -6.995678626
""").ravel()
_FILIP_X = np.append(
    _FILIP_X,
    _table("""
-6.691862621 -6.392544977 -6.067374056 -6.684029655 -6.378719832 -6.065855188
-5.752272167 -5.132414673 -4.811352704 -4.098269308 -3.66174277 -3.2644011
""").ravel(),
)
_FILIP_Y = _table("""
0.8116 0.9072 0.9052 0.9039 0.8053 0.8377 0.8667 0.8809 0.7975 0.8162
0.8515 0.8766 0.8885 0.8859 0.8959 0.8913 0.8959 0.8971 0.9021 0.909
0.9139 0.9199 0.8692 0.8872 0.89 0.891 0.8977 0.9035 0.9078 0.7675
0.7705 0.7713 0.7736 0.7775 0.7841 0.7971 0.8329 0.8641 0.8804 0.7668
0.7633 0.7678 0.7697 0.77 0.7749 0.7796 0.7897 0.8131 0.8498 0.8741
0.8061 0.846 0.8751 0.8856 0.8919 0.8934 0.894 0.8957 0.9047 0.9129
0.9209 0.9219 0.7739 0.7681 0.7665 0.7703 0.7702 0.7761 0.7809 0.7961
0.8253 0.8602 0.8809 0.8301 0.8664 0.8834 0.8898 0.8964 0.8963 0.9074
""").ravel()
_FILIP_Y = np.append(_FILIP_Y, [0.9119, 0.9228])
_TO_20 = np.arange(21.0)

LINEAR = {
    "Norris": Dataset(
        "Norris",
        _powers(_NORRIS[:, 1], 1),
        _NORRIS[:, 0],
        _product,
        (-0.262323073774029, 1.00211681802045),
        26.6173985294224,
    ),
    "Longley": Dataset(
        "Longley",
        np.column_stack([np.ones(len(_LONGLEY)), _LONGLEY[:, 1:]]),
        _LONGLEY[:, 0],
        _product,
        (
            -3482258.63459582,
            15.0618722713733,
            -0.358191792925910e-01,
            -2.02022980381683,
            -1.03322686717359,
            -0.511041056535807e-01,
            1829.15146461355,
        ),
        836424.055505915,
    ),
    "Wampler1": Dataset(
        "Wampler1",
        _powers(_TO_20, 5),
        _powers(_TO_20, 5).sum(axis=1),
        _product,
        (1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
        0.0,
    ),
    "Filip": Dataset(
        "Filip",
        _powers(_FILIP_X, 10),
        _FILIP_Y,
        _product,
        (
            -1467.48961422980,
            -2772.17959193342,
            -2316.37108160893,
            -1127.97394098372,
            -354.478233703349,
            -75.1242017393757,
            -10.8753180355343,
            -1.06221498588947,
            -0.670191154593408e-01,
            -0.246781078275479e-02,
            -0.402962525080404e-04,
        ),
        0.795851382172941e-03,
    ),
}


def _misra1a(x: Array, b: Array) -> Array:
    return b[0] * (1 - np.exp(-b[1] * x))


def _mgh09(x: Array, b: Array) -> Array:
    return b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3])


def _eckerle4(x: Array, b: Array) -> Array:
    return (b[0] / b[1]) * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2)


def _rat42(x: Array, b: Array) -> Array:
    return b[0] / (1 + np.exp(b[1] - b[2] * x))


def _thurber(x: Array, b: Array) -> Array:
    above = b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3
    return above / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def _nonlinear(
    name: str,
    model: Callable[[Array, Array], Array],
    starts: tuple[tuple[float, ...], ...],
    certified: tuple[float, ...],
    squares: float,
    table: str,
) -> Dataset:
    """Of a table of y and x."""
    y, x = _table(table).T
    return Dataset(name, x, y, model, certified, squares, starts)


NONLINEAR = {
    "Misra1a": _nonlinear(
        "Misra1a",
        _misra1a,
        ((500, 0.0001), (250, 0.0005)),
        (2.3894212918e02, 5.5015643181e-04),
        1.2455138894e-01,
        """
10.07 77.6
14.73 114.9
17.94 141.1
23.93 190.8
29.61 239.9
35.18 289.0
40.02 332.8
44.82 378.4
50.76 434.8
55.05 477.3
61.01 536.8
66.40 593.1
75.47 689.1
81.78 760.0
""",
    ),
    "MGH09": _nonlinear(
        "MGH09",
        _mgh09,
        ((25, 39, 41.5, 39), (0.25, 0.39, 0.415, 0.39)),
        (1.9280693458e-01, 1.9128232873e-01, 1.2305650693e-01, 1.3606233068e-01),
        3.0750560385e-04,
        """
0.1957 4.0
0.1947 2.0
0.1735 1.0
0.1600 0.5
0.0844 0.25
0.0627 0.167
0.0456 0.125
0.0342 0.1
0.0323 0.0833
0.0235 0.0714
0.0246 0.0625
""",
    ),
    "Eckerle4": _nonlinear(
        "Eckerle4",
        _eckerle4,
        ((1, 10, 500), (1.5, 5, 450)),
        (1.5543827178e00, 4.0888321754e00, 4.5154121844e02),
        1.4635887487e-03,
        """
0.0001575 400.0
0.0001699 405.0
0.0002350 410.0
0.0003102 415.0
0.0004917 420.0
0.0008710 425.0
0.0017418 430.0
0.0046400 435.0
0.0065895 436.5
0.0097302 438.0
0.0149002 439.5
0.0237310 441.0
0.0401683 442.5
0.0712559 444.0
0.1264458 445.5
0.2073413 447.0
0.2902366 448.5
0.3445623 450.0
0.3698049 451.5
0.3668534 453.0
0.3106727 454.5
0.2078154 456.0
0.1164354 457.5
0.0616764 459.0
0.0337200 460.5
0.0194023 462.0
0.0117831 463.5
0.0074357 465.0
0.0022732 470.0
0.0008800 475.0
0.0004579 480.0
0.0002345 485.0
0.0001586 490.0
0.0001143 495.0
0.0000710 500.0
""",
    ),
    "Rat42": _nonlinear(
        "Rat42",
        _rat42,
        ((100, 1, 0.1), (75, 2.5, 0.07)),
        (7.2462237576e01, 2.6180768402e00, 6.7359200066e-02),
        8.0565229338e00,
        """
8.930 9.0
10.800 14.0
18.590 21.0
22.330 28.0
39.350 42.0
56.110 57.0
61.730 63.0
64.620 70.0
67.080 79.0
""",
    ),
    "Thurber": _nonlinear(
        "Thurber",
        _thurber,
        ((1000, 1000, 400, 40, 0.7, 0.3, 0.03), (1300, 1500, 500, 75, 1, 0.4, 0.05)),
        (
            1.2881396800e03,
            1.4910792535e03,
            5.8323836877e02,
            7.5416644291e01,
            9.6629502864e-01,
            3.9797285797e-01,
            4.9727297349e-02,
        ),
        5.6427082397e03,
        """
80.574 -3.067
84.248 -2.981
87.264 -2.921
87.195 -2.912
89.076 -2.840
89.608 -2.797
89.868 -2.702
90.101 -2.699
92.405 -2.633
95.854 -2.481
100.696 -2.363
101.060 -2.322
401.672 -1.501
390.724 -1.460
567.534 -1.274
635.316 -1.212
733.054 -1.100
759.087 -1.046
894.206 -0.915
990.785 -0.714
1090.109 -0.566
1080.914 -0.545
1122.643 -0.400
1178.351 -0.309
1260.531 -0.109
1273.514 -0.103
1288.339 0.010
1327.543 0.119
1353.863 0.377
1414.509 0.790
1425.208 0.963
1421.384 1.006
1442.962 1.115
1464.350 1.572
1468.705 1.841
1447.894 2.047
1457.628 2.200
""",
    ),
}
"""Their difficulty in the standard: lower (Misra1a), higher (all others)."""
