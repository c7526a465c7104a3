"""Parts of ``canopen_cost.py``."""
