"""Several winches of one kind: a diagnosis of each, and their comparison.

``meta_analysis`` pools the parameters of effects that several winches share (random effects) and
tests their homogeneity; ``anova`` divides the variance of their errors into a common part and one
of each winch.

Over time: ``sessions`` fits one set of effects to every session; ``history`` tests the estimates
for changes (``changes``) and for winches that differ from the others (``partial_pooling``);
``limit_date`` extrapolates wear to a limit, ``swapped_profiles`` finds exchanged profiles.
"""
