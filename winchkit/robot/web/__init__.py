"""The Robot view of the page.

``view`` has its routes and orders, ``robot`` its state.
"""
