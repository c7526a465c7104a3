"""``winchkit library`` and ``winchkit fleet``: runs of many winches in a folder.

``index``, ``list`` and ``query`` are commands on the tables of the runs; ``diagnose`` fills those
of the diagnoses.
"""
