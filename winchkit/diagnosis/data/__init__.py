"""The data set: validated runs, repeats, decimation, spectra and transient masks.

Runs come in as measured and leave as :class:`~winchkit.diagnosis.data.dataset.Dataset`, which every
later stage shares.
"""
