"""Residual analysis: error statistics, attribution to variables (correlation ratio), maps."""
