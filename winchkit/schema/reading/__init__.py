"""Reader of declarations in TOML: text, lines of keys, tables into dataclasses.

A file is opened once (``source``), every key has its line (``lines``), and one error reports all
faults of a file. The public functions are in :mod:`winchkit.schema.read`.
"""
