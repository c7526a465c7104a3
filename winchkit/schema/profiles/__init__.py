"""Declarations of machines: winch, cable robot and sizing specification.

Frozen dataclasses in SI, read by :mod:`winchkit.schema.reading`.
"""
