"""Readers of files of other programs to columns.

``source`` chooses the format by the content: text, XLSX, MAT, HDF5, Parquet, NumPy, MCAP.
"""
