"""The regression problem: generalised least squares, noise, cross-validation, intervals.

A hypothesis (effects with values) predicts the outputs of every run; the whitened residual is
fitted by Levenberg–Marquardt and judged by held-out error.
"""
