"""The verdict: decision rule, specification test and equivalence of effects.

A named effect is withdrawn where a free curve predicts better (specification test); effects that
the runs cannot distinguish form an equivalence set.
"""
