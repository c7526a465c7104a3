"""Commissioning of a bench: trials, guided procedure, signed-off record, and its validity."""
