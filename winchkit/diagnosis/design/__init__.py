"""Design of the next experiment: discrimination of rival effects and detectable sizes.

:func:`~winchkit.diagnosis.design.plan.offers` ranks motion programmes by their power per minute.
"""
