"""Declarations of machines: winch, cable robot and sizing specification.

Plain frozen dataclasses in SI; reading them is the matter of :mod:`winchkit.schema.reading`.
"""
