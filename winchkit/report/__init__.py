"""Results as text, JSON and self-contained HTML pages.

``words`` formats numbers and sentences, ``figures`` computes what is drawn, ``html`` writes markup
and charts, ``pages`` composes whole pages. Nothing is estimated here.
"""
