"""Writers of logs in ASAM MDF 4 (extra ``mf4``) and of runs in Parquet (extra ``parquet``)."""

from __future__ import annotations

from pathlib import Path

from winchkit.extras import library
from winchkit.regular_file import file_errors
from winchkit.runs.log import Log
from winchkit.runs.run import Run


def write_mf4(log: Log, path: str | Path) -> None:
    """Write a log as MDF 4, a group per source; raises UsageError without asammdf, FileError."""
    asammdf = library("asammdf", f"{path}: MF4")
    start, _ = log.span
    with asammdf.MDF(version="4.10") as mdf:
        for source in log.layout.sources:
            samples = log.samples[source.topic]
            signals = [
                asammdf.Signal(
                    samples=samples.values[:, n],
                    timestamps=samples.times - start,
                    unit=signal.unit,
                    name=signal.column
                    or f"{source.topic.strip('/').replace('/', '.')}.{signal.name}",
                )
                for n, signal in enumerate(source.signals)
            ]
            mdf.append(signals, acq_name=source.topic, common_timebase=True)
        mdf.header.comment = "\n".join(f"{key}: {value}" for key, value in log.metadata.items())
        with file_errors(path):
            mdf.save(Path(path), overwrite=True)


def write_parquet(run: Run, path: str | Path) -> None:
    """Write a run as Parquet, null for NaN; raises UsageError without pyarrow, FileError."""
    library("pyarrow", f"{path}: Parquet")
    from pyarrow import parquet

    table = run.to_arrow()
    with file_errors(path), Path(path).open("wb") as stream:
        parquet.write_table(table, stream, compression="zstd")
