"""Data of the figures: reduced curves, residual maps, waterfalls; without any markup.

:mod:`winchkit.report.html` draws them. :func:`~winchkit.report.figures.plots.plots_of` is the
entry.
"""
