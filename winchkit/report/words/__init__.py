"""Text of results: numbers with units, vocabulary, columns, and sentences of verdicts.

:func:`~winchkit.report.words.sentence.sentence` is the verdict of a diagnosis.
"""
