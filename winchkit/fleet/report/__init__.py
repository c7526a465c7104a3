"""Pages and texts of many winches.

``comparison`` is of all winches of a recording, ``history`` and ``text`` of their changes over
time.
"""
