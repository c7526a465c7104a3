"""Display of results in consoles and notebooks, by renderers that are registered for their types.

A result type is :class:`Shown`, so that it has a short ``repr``, an HTML form and a figure. Their
look is defined above it: a package registers a :class:`Renderer` for the type. This module imports
neither of the two; the package that contains both names the module with the renderers
(:meth:`Renderers.load_from`), which is imported when the first result is shown.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Renderer(NamedTuple):
    """How results of one type are shown; no dataclass, whose import takes as long as winchkit's."""

    text: Callable[[Any], str]
    """One screen of plain text."""
    html: Callable[[Any], str]
    """One screen of HTML."""
    plot: Callable[..., Any] | None = None
    """Figure of matplotlib; None for a result without one."""


class Renderers:
    """Renderers by type, from a module that is imported when the first one is needed."""

    def __init__(self) -> None:
        self._by_type: dict[type, Renderer] = {}
        self._modules: list[str] = []

    def load_from(self, module: str) -> None:
        """Name a module that registers renderers when it is imported."""
        self._modules.append(module)

    def register(self, kind: type, renderer: Renderer) -> None:
        """Register the renderer of a type and of the types derived from it."""
        self._by_type[kind] = renderer

    def of(self, kind: type) -> Renderer | None:
        """Renderer of a type, or of the nearest type that it derives from; None without one."""
        while self._modules:
            import_module(self._modules.pop())
        known = (self._by_type.get(base) for base in kind.__mro__)
        return next((renderer for renderer in known if renderer is not None), None)


renderers = Renderers()
"""The renderers of this process; registered once, at import."""


class Shown:
    """A result with a short ``repr`` and an HTML form."""

    def __repr__(self) -> str:
        found = renderers.of(type(self))
        return object.__repr__(self) if found is None else found.text(self)

    def _repr_html_(self) -> str | None:
        found = renderers.of(type(self))
        return None if found is None else found.html(self)


class Plotted(Shown):
    """A result with a figure."""

    def plot(self, **options: Any) -> Figure:
        """Draw the result with matplotlib.

        Parameters
        ----------
        **options
            ``output`` or ``channels``: names of those to draw; by default all. ``figsize``: width
            and height of the figure, inches.

        Returns
        -------
        matplotlib.figure.Figure
            With a unit on every axis. ``figure.savefig("name.pdf")`` writes it.

        Raises
        ------
        UsageError
            Without matplotlib (``pip install 'winchkit[plot]'``), or for an unknown name.
        """
        from winchkit.errors import UsageError

        found = renderers.of(type(self))
        if found is None or found.plot is None:
            raise UsageError(f"{type(self).__name__}: there is no figure of it")
        figure: Figure = found.plot(self, **options)
        return figure
