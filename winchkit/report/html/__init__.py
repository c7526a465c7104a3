"""Self-contained HTML: escaped markup, SVG charts, and the frame of every page.

:func:`~winchkit.report.html.page.page` is the entry; a page needs no network.
"""
