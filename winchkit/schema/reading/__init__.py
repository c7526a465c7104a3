"""Reads declarations in TOML: text, lines of keys, tables into dataclasses.

A file is opened once (:mod:`source`), every key has its line (:mod:`lines`), and every fault of a
file is collected before one error names them all. :func:`winchkit.schema.read.read` is the entry.
"""
