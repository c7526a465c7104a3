"""Recording of a running bench: feed, recorder, live sinks, provenance and replay.

``feed`` copies each cycle without waiting, ``recorder`` writes it to a file, ``provenance`` adds
versions and calibrations. The entries are :class:`~winchkit.bench.recording.recorder.Recorder` and
:func:`~winchkit.bench.recording.replay.open_replay`.
"""
