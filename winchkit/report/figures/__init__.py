"""Data of the figures: reduced curves, residual maps, waterfalls; without any markup."""
