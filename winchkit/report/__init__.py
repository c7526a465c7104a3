"""Results as text, JSON and self-contained HTML pages.

``words`` formats numbers and sentences, ``figures`` computes the data of the figures, ``html``
writes markup and charts, ``pages`` composes whole pages, ``notebook`` shows results in consoles and
notebooks. This package estimates nothing.
"""
