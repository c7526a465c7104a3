"""The order of an effect that repeats within a turn: how many whole periods a turn holds."""

from __future__ import annotations

from winchkit.effects.effect import Parameter

__all__ = ["MOTOR_ORDERS", "order_per_turn"]

_MOST = 1000.0
MOTOR_ORDERS = (*map(float, range(1, 13)), 18.0, 24.0, 36.0)
"""Orders per motor turn at which poles, slots and teeth are looked for."""


def order_per_turn(orders: tuple[float, ...], typical: float) -> Parameter:
    """The parameter ``order``, looked for at ``orders``; a free one would fit anything periodic."""
    return Parameter(
        "order", "1", null=1.0, typical=typical, low=1.0, high=_MOST,
        role="shape", grid=orders, whole=True,
    )  # fmt: skip
