"""Effects on the cable length, one per file."""
