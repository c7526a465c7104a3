"""Import of recordings that other programs made.

``formats`` reads a file of any format to a
:class:`~winchkit.runs.importing.table.ColumnTable` of named columns; ``stored`` restores numbers
that a file stores modulo a range or without their sign; ``units`` reads the spellings of units;
``guess`` assigns columns to channels with
unit, factor and confidence; ``streams`` converts them to SI; ``clocks`` aligns several files;
``mapping`` stores the assignment.
"""
