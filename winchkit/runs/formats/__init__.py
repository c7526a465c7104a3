"""File formats of runs and logs: CSV, MCAP, Parquet and MF4."""
