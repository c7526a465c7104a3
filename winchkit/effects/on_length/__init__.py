"""Effects on the way from motor angle to cable length, one a file."""
