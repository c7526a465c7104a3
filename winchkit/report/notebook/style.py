"""Style of the figures: for print, two columns wide, fonts embedded.

Colours are those of Okabe and Ito, which readers with colour-vision deficiencies distinguish.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from winchkit.errors import UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLACK, BLUE, ORANGE, GREY = "#333333", "#0072B2", "#D55E00", "#999999"
_STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 0.9,
    "legend.frameon": False,
    "savefig.dpi": 300,
    "figure.dpi": 120,
    "axes.formatter.use_mathtext": True,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
WIDTH = 7.1
"""Width of two columns of a journal, inches."""

Size = tuple[float, float] | None


@contextmanager
def new_figure(size: tuple[float, float]) -> Iterator[Figure]:
    """An empty figure in the style of this package; of pyplot where that shows windows."""
    try:
        import matplotlib as mpl
        from matplotlib import pyplot
        from matplotlib.backends.registry import BackendFilter, backend_registry
        from matplotlib.figure import Figure
    except ImportError:
        raise UsageError(
            "figures need matplotlib; install it with pip install 'winchkit[plot]'"
        ) from None
    with mpl.rc_context(_STYLE):
        registry: Any = backend_registry
        windows = registry.list_builtin(BackendFilter.INTERACTIVE)
        # A notebook shows the returned figure: one of pyplot would be shown twice.
        shown = pyplot.get_backend().lower() in windows
        new = pyplot.figure if shown else Figure
        yield new(figsize=size, layout="constrained")
