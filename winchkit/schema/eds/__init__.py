"""Electronic data sheets (CiA 306): EDS and DCF files into sections and objects.

What can be repaired without doubt is repaired with a warning that names file, section and line.
:func:`~winchkit.schema.eds.eds.read_eds_text` is the entry.
"""
