"""Reads declarations in TOML: text, lines of keys, tables into dataclasses.

A file is opened once (``source``), every key has its line (``lines``), and every fault of a file is
collected before one error names them all. :mod:`winchkit.schema.read` has the entries.
"""
