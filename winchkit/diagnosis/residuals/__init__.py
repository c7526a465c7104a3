"""Residual analysis: error statistics, attribution to variables, maps.

``error_statistics`` has the errors per output, ``attribution`` the correlation ratio η² of each
variable, ``maps`` the mean residual over two variables. Fits and noise come from
:mod:`winchkit.diagnosis.regression`.
"""
