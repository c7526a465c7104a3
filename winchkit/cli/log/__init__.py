"""``winchkit log``: records benches; shows, recovers and replays what was recorded."""
