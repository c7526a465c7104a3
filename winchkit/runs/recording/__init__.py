"""Writers of logs of a bench: by channels (MCAP) or by rows (CSV), in parts, with file locks.

:func:`~winchkit.runs.recording.open_log.open_log` chooses the writer by the suffix; ``rotation``
begins a new part by size or duration.
"""
