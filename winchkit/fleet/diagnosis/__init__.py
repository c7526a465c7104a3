"""Several winches of one kind: a diagnosis of each, and their comparison.

Over time one set of effects is fitted to every session, so that its estimates can be compared.
"""
