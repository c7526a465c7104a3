"""A diagnosis as a page, as text for a terminal, and in one sentence."""
