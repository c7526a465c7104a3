"""The log that a station writes: how many rows, and its end."""

from __future__ import annotations

from winchkit.bench.recording.recorder import Recorder


class OwnedLog:
    """What stations with and without drives do with their log."""

    _recorder: Recorder | None = None

    def log_rows(self) -> int:
        """Rows written so far; raises the error that has ended the writing."""
        if self._recorder is None:
            return 0
        self._recorder.check()
        return self._recorder.rows

    def end_log(self) -> int:
        """End the log and return its rows."""
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return 0
        recorder.close()
        return recorder.rows
