"""The Robot view of the page.

``view`` has its routes and orders, ``robot`` its state, ``live_robot`` the platform of an open
bench, ``programmes`` the preview of a programme.
"""
