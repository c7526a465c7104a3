"""Residual analysis after the fit.

Its power above the low-pass filter's cut-off (``stop_band_leakage``), its attribution to variables
and orders by the correlation ratio η² (``attribution``), its means over two variables (``maps``),
and its values over time (``traces``).
"""
