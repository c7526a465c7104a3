"""Arrays of expressions in place of numbers: what a function of numpy computes, as formulas.

A function is run once on arrays of symbols; every numpy function that it calls is recorded. Code
that branches on the motion or needs numbers raises TypeError.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.dynamics.expression import OPERATIONS, Expression, apply, number, rate

_SAME_AS = {"true_divide": "divide", "float_power": "power", "bitwise_and": "logical_and",
            "bitwise_or": "logical_or", "fabs": "absolute", "fmax": "maximum"}  # fmt: skip
_PRODUCTS = {"square": ("multiply", None), "positive": ("add", 0.0)}
"""Functions of one argument as an operation with itself, or with a number."""


def expression(x: object) -> Expression:
    """An element of an array as an expression. Raises TypeError for anything but a number."""
    if isinstance(x, Expression):
        return x
    if isinstance(x, np.ndarray):
        return expression(x.item())
    if isinstance(x, int | float | np.number | np.bool_):
        return number(float(x))
    raise TypeError(f"{type(x).__name__} is no number")


def _elementwise(operation: Callable[..., Expression], arguments: Sequence[object]) -> Traced:
    arrays = np.broadcast_arrays(*(np.asarray(x, dtype=object) for x in arguments))
    out = np.empty(arrays[0].shape, dtype=object)
    for index in np.ndindex(out.shape):
        out[index] = operation(*(expression(a[index]) for a in arrays))
    return out.view(Traced)


def _ufunc(name: str, arguments: Sequence[object]) -> Traced:
    name = _SAME_AS.get(name, name)
    if name in _PRODUCTS:
        name, other = _PRODUCTS[name]
        arguments = [arguments[0], arguments[0] if other is None else other]
    if name == "logical_not":
        name, arguments = "equal", [arguments[0], 0.0]
    if name not in OPERATIONS:
        raise TypeError(f"numpy.{name} has no formula here")
    return _elementwise(lambda *x: apply(name, *x), arguments)


def _where(test: object, a: object, b: object) -> Traced:
    return _elementwise(lambda *x: apply("where", *x), [test, a, b])


def _clip(x: object, low: object, high: object) -> Traced:
    return _ufunc("minimum", [_ufunc("maximum", [x, low]), high])


def _interp(x: object, places: Sequence[float], values: Sequence[float]) -> Traced:
    """Straight lines between points, constant beyond them."""
    inner = _clip(x, places[0], places[-1])
    out: Any = values[0]
    for k in range(len(places) - 1):
        slope = (values[k + 1] - values[k]) / (places[k + 1] - places[k])
        out = _where(inner >= places[k], values[k] + slope * (inner - places[k]), out)
    return _ufunc("add", [out, 0.0])


def _full(shape_of: Array, value: object, *_: object, **__: object) -> Traced:
    return _ufunc("add", [np.zeros(np.shape(shape_of)), value])


class Traced(np.ndarray[Any, Any]):
    """An array of expressions."""

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = None, where: Any = True,
        **_: Any,
    ) -> Any:  # fmt: skip
        """Record an operation on every element."""
        if method == "reduce" and len(inputs) == 1:
            array = np.asarray(inputs[0], dtype=object)
            name = _SAME_AS.get(ufunc.__name__, ufunc.__name__)
            folded = reduce(lambda a, b: apply(name, a, b), map(expression, array.ravel()))
            return traced([folded])[0]
        if method != "__call__":
            raise TypeError(f"numpy.{ufunc.__name__}.{method} has no formula here")
        if ufunc is np.matmul:
            # numpy multiplies and adds matrices of objects by the operators of these.
            return np.matmul(*(np.asarray(traced(x)) for x in inputs)).view(Traced)
        result = _ufunc(ufunc.__name__, inputs)
        if where is not True:
            return _where(where, result, out[0] if out is not None else 0.0)
        if out is not None:
            out[0][...] = result
            return out[0]
        return result

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        """Record the functions that are no ufuncs; numpy's own code runs on the others."""
        if func is np.gradient:
            return _elementwise(rate, [args[0]])
        if (own := _FUNCTIONS.get(func)) is not None:
            return own(*args, **{k: v for k, v in kwargs.items() if k != "dtype"})
        found = super().__array_function__(func, types, args, kwargs)
        is_traced = isinstance(found, np.ndarray) and found.dtype == object
        return found.view(Traced) if is_traced else found

    def __getitem__(self, key: Any) -> Any:
        """Elements stay arrays, so that what is computed of them is recorded too."""
        found = super().__getitem__(key)
        return traced(found) if isinstance(found, Expression) else found

    def astype(self, *_: Any, **__: Any) -> Any:
        """A copy: expressions have no type."""
        return self.copy()


_FUNCTIONS: Mapping[Any, Callable[..., Any]] = {
    np.where: _where,
    np.clip: _clip,
    np.interp: _interp,
    np.full_like: _full,
    np.zeros_like: lambda of, **_: _full(of, 0.0),
    np.ones_like: lambda of, **_: _full(of, 1.0),
}


def traced(value: object) -> Any:
    """An array of expressions from one, from several, or from numbers."""
    array: NDArray[Any] = np.array(value, dtype=object)
    return _elementwise(lambda x: x, [array])
