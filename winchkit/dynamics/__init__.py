"""Forward dynamics: the motion of a profile under a torque or a reference, and its formulas.

The formulas of the line and its effects are recorded by running them once on symbols. The package
imports nothing of the simulated benches.
"""
