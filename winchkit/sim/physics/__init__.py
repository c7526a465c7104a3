"""The simulator's physics, one class per effect, independent of the catalogue of effects.

``table`` gives each a name and an order; ``beyond`` has those that no effect of the catalogue
describes. :func:`~winchkit.sim.physics.table.build` is the entry.
"""
