"""A library: a folder tree of runs, and Parquet tables beside it that can be rebuilt from it.

``tables`` declares their columns.
"""
