"""``winchkit sim`` and ``winchkit demo``: simulated benches, and the procedure on one.

``record`` simulates without buses, ``serve`` on real ones; ``demo`` runs from a jog to the verdict.
"""
