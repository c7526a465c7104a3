"""Electronic data sheets (CiA 306): EDS and DCF files into sections and objects.

Faults with one possible meaning are repaired, with a warning that names file, section and line.
:func:`~winchkit.schema.eds.eds.read_eds_text` is the entry.
"""
