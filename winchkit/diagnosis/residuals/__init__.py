"""Residual analysis: what remains after the fit.

Errors per output (``error_statistics``), their attribution to variables and orders by the
correlation ratio η² (``attribution``), and their means over two variables (``maps``).
"""
