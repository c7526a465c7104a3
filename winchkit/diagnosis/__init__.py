"""Diagnosis: which physical effects a model lacks, by comparison with measured runs.

Measured runs pass the packages in this order: ``data`` (validation, repeats, spectra),
``regression`` (generalised least squares, noise, cross-validation), ``selection`` (stepwise
selection of effects) beside ``residuals`` (attribution of what remains), then ``verdict``
(decision rule, specification test, equivalence sets) and ``design`` (the next experiment).
The public functions are :func:`winchkit.compare`, :func:`winchkit.diagnose`,
:func:`winchkit.plan` and :func:`winchkit.add`; their results are the dataclasses of ``results``.
For a robot they call its wing, whose regression of poses the same selection searches.
docs/methods.md describes every test for a statistician.
"""
