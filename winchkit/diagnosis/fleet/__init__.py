"""Several winches of one kind: a diagnosis each, and random-effects meta-analysis.

``diagnose`` diagnoses each winch of a recording, ``meta_analysis`` pools the sizes of common
effects, ``anova`` compares their errors. The entries are
:func:`~winchkit.diagnosis.fleet.diagnose.diagnose_each` and
:func:`~winchkit.diagnosis.fleet.meta_analysis.shared_effects`.
"""
