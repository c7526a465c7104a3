"""Selection of effects: score tests, forward selection, exchange, backward elimination.

Candidates are scored by their explained squares after projection, fitted, and accepted by
out-of-sample tests.
"""
