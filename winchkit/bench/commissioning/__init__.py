"""Commissioning of a bench: trials, guided procedure, signed record, and its validity.

``trial`` proves host loss, stops and brakes of each drive, ``motions`` makes small motions,
``record`` is the file that permits motion, and whether it holds for the bench.
:func:`~winchkit.bench.commissioning.procedure.commission_bench` is the entry.
"""
