"""``winchkit library`` and ``winchkit fleet``: runs of many winches in a folder.

``diagnose`` fills the tables that ``list`` and ``query`` read.
"""
