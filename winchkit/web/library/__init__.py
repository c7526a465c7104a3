"""The Library view: runs of a folder with their verdicts, and the fleet as a grid.

:mod:`~winchkit.web.library.runs` lists and overlays runs, :mod:`~winchkit.web.library.fleet` shows
one set of effects over winches and time.
"""
