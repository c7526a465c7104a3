"""Design of the next experiment: discrimination of rival effects and detectable sizes.

:func:`~winchkit.diagnosis.design.plan.plan` ranks motion programmes by their power per minute.
"""
