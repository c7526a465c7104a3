"""Regression: generalised least squares, noise, lack of fit, cross-validation, intervals.

A :class:`~winchkit.diagnosis.regression.base.Regression` predicts its rows from a hypothesis
(effects with values): spectral coefficients of a winch's runs, or poses of a robot.
"""
