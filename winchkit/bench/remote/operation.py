"""What makes a method an operation of a bench, and what every station has."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

from winchkit.bench.remote.identity import Client
from winchkit.drivers.clock import Clock
from winchkit.schema.programme import ALL

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench
    from winchkit.bench.winch import Winch

_Method = TypeVar("_Method", bound=Callable[..., Any])

OPERATIONS: dict[str, bool] = {}
"""Whether it begins or extends a motion, by operation; such a request is refused where it has been
on its way for too long."""


def operation(*, begins: bool = False) -> Callable[[_Method], _Method]:
    """A method that a station of the owner's process carries out, and any other one requests."""

    def operation_of(method: _Method) -> _Method:
        name, signature = method.__name__, inspect.signature(method)
        OPERATIONS[name] = begins

        @wraps(method)
        def call(station: BaseStation, *arguments: Any, **named: Any) -> Any:
            if not station._is_remote:
                return method(station, *arguments, **named)
            asked = signature.bind(station, *arguments, **named)
            asked.apply_defaults()
            return station._request(name, *asked.args[1:], **asked.kwargs)

        return cast(_Method, call)

    return operation_of


class BaseStation:
    """An operator's place at a bench. Closing it ends what it has started."""

    _is_remote: ClassVar[bool] = False
    """Whether another process owns the bench: every operation is requested from it."""
    client: Client
    """For whom it orders; in the owner's process, as what follows."""
    _bench: Bench

    def _request(self, operation: str, *arguments: Any, **named: Any) -> Any:
        """Have the owner carry out an operation."""
        raise NotImplementedError(operation)

    @property
    def clock(self) -> Clock:
        """Clock of the bench, on which a client waits."""
        return self._bench.clock

    def close(self) -> None:
        """Stop what was started here, finish the log."""
        raise NotImplementedError

    def _acting(self) -> AbstractContextManager[None]:
        """Orders within it are this station's client's."""
        return self._bench.commanders.acting(self.client)

    def _chosen(self, winch: str | None) -> list[Winch]:
        """One winch, or with "all" every one."""
        every = list(self._bench.winch.values())
        return every if winch == ALL else [self._bench.named(winch)]
