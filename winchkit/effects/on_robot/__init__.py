"""Effects that only a robot can have: its geometry, its home and its payload."""
