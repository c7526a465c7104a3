"""Whole pages, one module for each subject, composed of figures, tables and sentences.

:func:`~winchkit.report.pages.pages.report_html` is the page of a diagnosis; ``parts`` has what
several pages share.
"""
