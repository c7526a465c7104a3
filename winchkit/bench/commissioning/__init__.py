"""Commissioning of a bench: trials, guided procedure, signed record, and its validity."""
