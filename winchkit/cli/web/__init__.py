"""Commands of the page in the browser.

``serve`` has the command; :mod:`winchkit.web` what it serves.
"""
