"""Changes of profile files: fitted effects, the ledger of steps, and their history.

A profile is edited as a TOML document, so that comments and order stay.
"""
