"""Differences of one quantity between two samples, without cancellation.

Friction with memory takes the change of a length between two samples. Computed as the difference of
two rounded lengths it loses the digits that they share, in single precision all of a slow motion.
Expanded down to the differences of the inputs, Δ(ab) = a Δb + b₀ Δa for example, each of which is
exact for neighbouring numbers (Sterbenz 1974), it is rounded as any product.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from winchkit.dynamics.expression import Expression, apply, number, ordered

Known = dict[tuple[int, int], "Expression | None"]
"""Expanded differences by the two expressions; None where these are not one quantity."""


def with_exact_differences(
    roots: Sequence[Expression], before: Mapping[str, str]
) -> list[Expression]:
    """Expressions whose differences between two samples are expanded; ``before`` has for each input
    the name of its symbol in the sample before."""
    new: dict[int, Expression] = {}
    known: Known = {}
    for one in ordered(roots):
        of = [new[id(a)] for a in one.arguments]
        same = all(a is b for a, b in zip(of, one.arguments, strict=True))
        found = one if same else apply(one.operation, *of)
        if one.operation == "subtract":
            difference = _difference(of[0], of[1], before, known)
            found = found if difference is None else difference
        new[id(one)] = found
    return [new[id(root)] for root in roots]


def _difference(
    now: Expression, then: Expression, before: Mapping[str, str], known: Known
) -> Expression | None:
    """The expanded difference, None as in :data:`Known`; formulas nest deeper than calls may."""
    stack = [(now, then)]
    while stack:
        a, b = stack[-1]
        inner = zip(a.arguments, b.arguments, strict=False) if a.operation == b.operation else ()
        missing = [pair for pair in inner if tuple(map(id, pair)) not in known]
        if missing:
            stack += missing
        else:
            known[id(a), id(b)] = _expanded(a, b, before, known)
            stack.pop()
    return known[id(now), id(then)]


def _expanded(
    now: Expression, then: Expression, before: Mapping[str, str], known: Known
) -> Expression | None:
    """The difference from those of the arguments."""
    if now is then or (now.operation == then.operation == "number" and now.value == then.value):
        return number(0)
    plain = Expression("subtract", (now, then))
    if now.name and before.get(now.name) == then.name:
        return plain
    if now.operation != then.operation or not now.arguments:
        return None
    changes = [known[id(a), id(b)] for a, b in zip(now.arguments, then.arguments, strict=True)]
    if None in changes:
        return None
    rule = _RULES.get(now.operation)
    return plain if rule is None else rule(now, then, plain, *changes)


def _of_branch(
    tests: Sequence[Expression], a: Expression, b: Expression, plain: Expression
) -> Expression:
    """The change of the branch that both samples are on."""
    return apply("where", apply("equal", *tests), apply("where", tests[0], a, b), plain)


def _of_choice(comparison: str) -> Callable[..., Expression]:
    """Of the larger or the smaller of two, by the comparison that gives the first."""
    return lambda now, then, plain, a, b: _of_branch(
        [apply(comparison, *x.arguments) for x in (now, then)], a, b, plain
    )


_RULES: Mapping[str, Callable[..., Expression]] = {
    "add": lambda now, then, plain, a, b: a + b,
    "subtract": lambda now, then, plain, a, b: a - b,
    "negative": lambda now, then, plain, a: apply("negative", a),
    "multiply": lambda now, then, plain, a, b: now.arguments[0] * b + then.arguments[1] * a,
    "divide": lambda now, then, plain, a, b: (a - then * b) / now.arguments[1],
    "maximum": _of_choice("greater_equal"),
    "minimum": _of_choice("less_equal"),
    "where": lambda now, then, plain, test, a, b: _of_branch(
        [now.arguments[0], then.arguments[0]], a, b, plain
    ),
}
"""Difference of an operation from both samples, the plain difference and those of its arguments."""
