"""File formats of runs and logs: CSV, MCAP, Parquet and MF4.

A file per reader and writer; :func:`winchkit.read_run` and :func:`winchkit.write_run` choose one by
the suffix.
"""
