"""Regression: generalised least squares, noise, lack of fit, cross-validation, intervals.

A :class:`~winchkit.diagnosis.regression.base.Regression` predicts its rows from a hypothesis
(effects with values) and is implemented by the spectral coefficients of a winch's runs and by the
poses of a robot. The whitened residual is fitted in a trust region (Levenberg-Marquardt), tested
against the pure error of repeats, and compared with other models by held-out error.
"""
