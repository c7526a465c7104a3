"""Selection of effects: scores, forward selection, exchange, backward elimination.

A :class:`~winchkit.diagnosis.selection.engine.SelectionEngine` scores candidates by their explained
sum of squares after projection with a BIC penalty. The best are fitted and accepted by
cross-validation; pairs that mask each other are screened jointly. The procedure is
:func:`~winchkit.diagnosis.selection.stepwise.stepwise_selection`, for winches and robots alike.
"""
