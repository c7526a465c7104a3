"""Results in consoles and notebooks: one screen of text or HTML, and figures by matplotlib.

Importing :mod:`winchkit.report.notebook.register` registers them for the result types, which know
none of this (:mod:`winchkit.rendering`).
"""
