"""The Library view: runs of a folder with their verdicts, and the fleet as a grid.

:mod:`~winchkit.fleet.web.runs` lists and overlays runs, :mod:`~winchkit.fleet.web.fleet` shows
one set of effects over winches and time.
"""
