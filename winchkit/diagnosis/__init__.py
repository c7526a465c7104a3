"""Diagnosis: effects that a model lacks, by comparison with measured runs.

Runs pass ``data``, ``regression``, ``residuals``, ``selection`` and ``verdict`` in this order;
``design`` proposes the next run, ``fleet`` joins several winches, ``robot`` is the same for cable
robots. The public functions are :func:`winchkit.compare`, :func:`winchkit.diagnose`,
:func:`winchkit.plan` and :func:`winchkit.add`.
"""
