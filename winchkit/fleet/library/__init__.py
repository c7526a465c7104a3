"""A library: a folder tree of runs, and Parquet tables beside it that can be rebuilt from it.

``tables`` declares the columns, ``partitions`` writes them, ``index`` fills the table of runs,
``query`` reads; ``sessions``, ``diagnose`` and ``cluster`` diagnose many winches.
"""
