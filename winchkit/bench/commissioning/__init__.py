"""Commissioning of a bench: trials, guided procedure, signed record, and its validity.

``trial`` proves host loss, stops and brakes of each drive, ``motions`` makes small motions,
``record`` is the file that permits motion, ``validity`` compares it with the bench.
:func:`~winchkit.bench.commissioning.procedure.commission_bench` is the entry.
"""
