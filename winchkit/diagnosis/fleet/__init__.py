"""Several winches of one kind: a diagnosis of each, and their comparison.

``meta_analysis`` pools the parameters of effects that several winches share (random effects) and
tests their homogeneity; ``anova`` divides the variance of their errors into a common part and one
of each winch.
"""
