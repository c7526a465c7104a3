"""Expressions of scalars: a graph with derivatives, printed as Python and as C.

The formulas of a profile stand once, in its drum, pulleys and effects. Traced on symbols
(:mod:`winchkit.dynamics.tracing`) they become expressions, which are differentiated along a motion
exactly and printed in the language that evaluates them.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

Slope: TypeAlias = "Callable[[Sequence[Expression]], Sequence[Expression | None]]"
"""Derivatives of an operation by its arguments, None for zero."""


@dataclass(frozen=True, eq=False, slots=True)
class Expression:
    """An operation on expressions, a symbol or a number; equal ones are different objects."""

    operation: str
    arguments: tuple[Expression, ...] = ()
    value: float = math.nan
    """Of a number, and of a symbol that is known; NaN where it is not."""
    name: str = ""
    """Of a symbol."""
    rate: Expression | None = None
    """Of a symbol: its derivative by time, None for zero."""

    def __bool__(self) -> bool:
        """Truth of a comparison of known numbers; raises TypeError for an unknown one."""
        known = known_value(self)
        if math.isnan(known):
            raise TypeError("a branch depends on the motion; write it with numpy.where")
        return bool(known)

    def __add__(self, other: Expression) -> Expression:
        return apply("add", self, other)

    def __sub__(self, other: Expression) -> Expression:
        return apply("subtract", self, other)

    def __mul__(self, other: Expression) -> Expression:
        return apply("multiply", self, other)

    def __truediv__(self, other: Expression) -> Expression:
        return apply("divide", self, other)

    def __float__(self) -> float:
        """Raise TypeError: a number would hide what it depends on."""
        if self.operation != "number":
            raise TypeError("float() of a value that depends on the motion")
        return self.value


def number(value: float) -> Expression:
    """A constant."""
    return Expression("number", value=float(value))


def symbol(name: str, value: float = math.nan, rate: Expression | None = None) -> Expression:
    """A symbol; with its ``value`` where it is a known parameter."""
    return Expression("symbol", value=value, name=name, rate=rate)


@dataclass(frozen=True)
class Operation:
    """One operation: its evaluation, its text in Python and in C, and its derivatives."""

    evaluate: Callable[..., float]
    python: str
    c: str
    slopes: Slope


def sign(x: float) -> float:
    """-1, 0 or 1; 0 of NaN."""
    return float((x > 0) - (x < 0))


def over(a: float, b: float) -> float:
    """a/b as IEEE 754 has it: branches that are not taken divide by zero."""
    return a / b if b else math.nan if not a or math.isnan(a) else math.copysign(math.inf, a)


def power(a: float, b: float) -> float:
    """a to the b; NaN where that is complex, infinite for a zero with a negative b."""
    try:
        return float(a**b) if a >= 0 or b == int(b) else math.nan
    except ZeroDivisionError:
        return math.inf


def root(x: float) -> float:
    """Square root; NaN of negative numbers."""
    return math.sqrt(x) if x >= 0 else math.nan


def _flat(count: int) -> Slope:
    return lambda _: (None,) * count


def _unary(name: str, slope: Callable[[Expression], Expression]) -> Operation:
    return Operation(
        getattr(math, name), f"{name}({{}})", f"F({name})({{}})", lambda x: (slope(x[0]),)
    )


def _comparison(text: str, evaluate: Callable[[float, float], object], in_c: str = "") -> Operation:
    return Operation(
        lambda a, b: float(bool(evaluate(a, b))),
        f"(1.0 if {{}} {text} {{}} else 0.0)",
        f"(real)({{}} {in_c or text} {{}})",
        _flat(2),
    )


OPERATIONS: Mapping[str, Operation] = {
    "add": Operation(operator.add, "({} + {})", "({} + {})", lambda x: (number(1), number(1))),
    "subtract": Operation(
        operator.sub, "({} - {})", "({} - {})", lambda x: (number(1), number(-1))
    ),
    "multiply": Operation(operator.mul, "({} * {})", "({} * {})", lambda x: (x[1], x[0])),
    "divide": Operation(
        over,
        "over({}, {})",
        "({} / {})",
        lambda x: (number(1) / x[1], number(-1) * x[0] / (x[1] * x[1])),
    ),
    "power": Operation(
        power,
        "power({}, {})",
        "F(pow)({}, {})",
        lambda x: (
            x[1] * apply("power", x[0], x[1] - number(1)),
            None if x[1].operation == "number" else apply("power", *x) * apply("log", x[0]),
        ),
    ),
    "negative": Operation(operator.neg, "(-{})", "(-{})", lambda x: (number(-1),)),
    "absolute": Operation(abs, "abs({})", "F(fabs)({})", lambda x: (apply("sign", x[0]),)),
    "sign": Operation(sign, "sign({})", "(real)(({0} > 0) - ({0} < 0))", _flat(1)),
    "floor": Operation(lambda x: float(math.floor(x)), "floor({})", "F(floor)({})", _flat(1)),
    "sqrt": Operation(
        root,
        "root({})",
        "F(sqrt)({})",
        lambda x: (number(0.5) / apply("sqrt", x[0]),),
    ),
    "exp": _unary("exp", lambda x: apply("exp", x)),
    "expm1": _unary("expm1", lambda x: apply("exp", x)),
    "log": _unary("log", lambda x: number(1) / x),
    "log1p": _unary("log1p", lambda x: number(1) / (number(1) + x)),
    "sin": _unary("sin", lambda x: apply("cos", x)),
    "cos": _unary("cos", lambda x: apply("negative", apply("sin", x))),
    "tanh": _unary("tanh", lambda x: number(1) - apply("tanh", x) * apply("tanh", x)),
    "hypot": Operation(
        math.hypot,
        "hypot({}, {})",
        "F(hypot)({}, {})",
        lambda x: tuple(one / apply("hypot", *x) for one in x),
    ),
    "arctan2": Operation(
        math.atan2,
        "atan2({}, {})",
        "F(atan2)({}, {})",
        lambda x: (
            x[1] / (x[0] * x[0] + x[1] * x[1]),
            number(-1) * x[0] / (x[0] * x[0] + x[1] * x[1]),
        ),
    ),
    "maximum": Operation(
        max,
        "max({}, {})",
        "F(fmax)({}, {})",
        lambda x: (apply("greater_equal", *x), apply("less", *x)),
    ),
    "minimum": Operation(
        min,
        "min({}, {})",
        "F(fmin)({}, {})",
        lambda x: (apply("less_equal", *x), apply("greater", *x)),
    ),
    "where": Operation(
        lambda test, a, b: a if test else b,
        "({1} if {0} else {2})",
        "({0} != 0 ? {1} : {2})",
        lambda x: (
            None,
            apply("where", x[0], number(1), number(0)),
            apply("where", x[0], number(0), number(1)),
        ),
    ),
    "less": _comparison("<", operator.lt),
    "less_equal": _comparison("<=", operator.le),
    "greater": _comparison(">", operator.gt),
    "greater_equal": _comparison(">=", operator.ge),
    "equal": _comparison("==", operator.eq),
    "not_equal": _comparison("!=", operator.ne),
    "logical_and": _comparison("and", lambda a, b: a and b, "&&"),
    "logical_or": _comparison("or", lambda a, b: a or b, "||"),
}
"""Operations by the name of their numpy function."""


def apply(operation: str, *arguments: Expression) -> Expression:  # noqa: PLR0911 - one for each rule
    """An operation on expressions; constants are evaluated, and neutral elements left out."""
    if all(x.operation == "number" for x in arguments):
        return number(OPERATIONS[operation].evaluate(*(x.value for x in arguments)))
    first, second = arguments[0], arguments[-1]
    match operation:
        case "add" if _is(first, 0.0):
            return second
        case "add" | "subtract" if _is(second, 0.0):
            return first
        case "subtract" if first.operation == "add" and second in first.arguments:
            # What was added, without the rounding of the sum.
            return first.arguments[first.arguments[0] is second]
        case "subtract" if second.operation == "subtract" and second.arguments[0] is first:
            return second.arguments[1]
        case "multiply" if _is(first, 0.0) or _is(second, 0.0):
            return number(0)
        case "multiply" if _is(first, 1.0):
            return second
        case "multiply" | "divide" | "power" if _is(second, 1.0):
            return first
        case "divide" if _is(first, 0.0):
            return first
        case "power" if _is(second, 2.0):
            return Expression("multiply", (first, first))
        case "where" if first.operation == "number":
            return arguments[1] if first.value else second
    return Expression(operation, arguments)


def _is(x: Expression, value: float) -> bool:
    return x.operation == "number" and x.value == value


def known_value(x: Expression) -> float:
    """Value of an expression of numbers and known symbols; NaN where one is unknown."""
    values: dict[int, float] = {}
    for one in ordered([x]):
        if one.arguments:
            of = [values[id(a)] for a in one.arguments]
            unknown = any(map(math.isnan, of))
            values[id(one)] = math.nan if unknown else OPERATIONS[one.operation].evaluate(*of)
        else:
            values[id(one)] = one.value
    return values[id(x)]


def ordered(roots: Iterable[Expression]) -> list[Expression]:
    """Every expression that ``roots`` need, each once, arguments before what uses them."""
    done: dict[int, Expression] = {}
    stack = [(root, False) for root in roots]
    while stack:
        one, ready = stack.pop()
        if id(one) in done:
            continue
        if ready or not one.arguments:
            done[id(one)] = one
        else:
            stack.append((one, True))
            stack.extend((a, False) for a in one.arguments)
    return list(done.values())


def symbols_of(roots: Iterable[Expression]) -> set[str]:
    """Names of the symbols that expressions depend on."""
    return {one.name for one in ordered(roots) if one.operation == "symbol"}


def derivative(x: Expression, by: str) -> Expression:
    """Partial derivative of an expression by a symbol."""
    return _derivative(x, lambda one: number(one.name == by))


def rate(x: Expression, rates: Mapping[str, Expression] | None = None) -> Expression:
    """Derivative of an expression by time; ``rates`` are of further symbols."""

    def of_symbol(one: Expression) -> Expression:
        own = (rates or {}).get(one.name, one.rate)
        return number(0) if own is None else own

    return _derivative(x, of_symbol)


def _derivative(x: Expression, of_symbol: Callable[[Expression], Expression]) -> Expression:
    slopes: dict[int, Expression] = {}
    for one in ordered([x]):
        total = of_symbol(one) if one.operation == "symbol" else number(0)
        if one.arguments and any(not _is(slopes[id(a)], 0.0) for a in one.arguments):
            by = OPERATIONS[one.operation].slopes(one.arguments)
            for argument, slope in zip(one.arguments, by, strict=True):
                own = slopes[id(argument)]
                if slope is not None and not _is(own, 0.0):
                    total = total + slope * own
        slopes[id(one)] = total
    return slopes[id(x)]


def substituted(roots: Sequence[Expression], values: Mapping[str, Expression]) -> list[Expression]:
    """Expressions with other expressions in place of symbols."""
    new: dict[int, Expression] = {}
    for one in ordered(roots):
        if one.arguments:
            of = [new[id(a)] for a in one.arguments]
            same = all(a is b for a, b in zip(of, one.arguments, strict=True))
            new[id(one)] = one if same else apply(one.operation, *of)
        else:
            new[id(one)] = values.get(one.name, one) if one.name else one
    return [new[id(root)] for root in roots]


def statements(
    roots: Sequence[Expression],
    names: Mapping[str, str],
    text: Callable[[Operation], str],
    literal: Callable[[float], str],
) -> tuple[list[tuple[str, str]], list[str]]:
    """Assignments of a program that evaluates expressions, equal ones once, and the text of every
    root; ``names`` are those of the symbols in the program."""
    lines: list[tuple[str, str]] = []
    seen: dict[str, str] = {}
    of: dict[int, str] = {}
    for one in ordered(roots):
        if one.operation == "number":
            of[id(one)] = literal(one.value)
        elif one.operation == "symbol":
            of[id(one)] = names.get(one.name, one.name)
        else:
            right = text(OPERATIONS[one.operation]).format(*(of[id(a)] for a in one.arguments))
            if right not in seen:
                seen[right] = f"t{len(lines)}"
                lines.append((seen[right], right))
            of[id(one)] = seen[right]
    return lines, [of[id(root)] for root in roots]


_GLOBALS: dict[str, Any] = {
    **{name: getattr(math, name) for name in OPERATIONS if hasattr(math, name)},
    "atan2": math.atan2,
    "floor": lambda x: float(math.floor(x)),
    "over": over,
    "power": power,
    "root": root,
    "sign": sign,
    "nan": math.nan,
    "inf": math.inf,
}


def compiled(
    roots: Sequence[Expression], arguments: Sequence[str]
) -> Callable[..., tuple[float, ...]]:
    """A function of floats with these arguments that returns the values of ``roots``."""
    names = {name: f"x{index}" for index, name in enumerate(arguments)}
    missing = symbols_of(roots) - set(names)
    if missing:
        raise TypeError(f"unknown symbols {sorted(missing)}")
    lines, results = statements(roots, names, lambda o: o.python, repr)
    body = "".join(f"    {name} = {right}\n" for name, right in lines)
    result = "".join(f"{one}, " for one in results)
    source = f"def function({', '.join(names.values())}):\n{body}    return ({result})\n"
    space = dict(_GLOBALS)
    exec(source, space)
    function: Callable[..., tuple[float, ...]] = space["function"]
    return function
