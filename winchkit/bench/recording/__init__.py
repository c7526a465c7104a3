"""Recording of a running bench: feed, recorder, live sinks, provenance and replay."""
