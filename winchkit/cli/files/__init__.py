"""Commands for files: check, export and shell completion.

``check`` reads a file of any kind and reports all its faults; the files ``check_…`` have the checks
of one kind each.
"""
