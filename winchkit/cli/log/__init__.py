"""``winchkit log``: records a bench; describes, recovers and replays logs.

``log`` is the group of commands and records; the other files are a command each.
"""
