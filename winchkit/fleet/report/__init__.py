"""Pages and texts of many winches.

``comparison`` is of one recording each, ``history`` of their changes over time.
"""
