"""Changes of profile files: fitted effects, the ledger of steps, and their history.

A profile is edited as a TOML ``document``, so that comments and order stay. The entries are
:func:`~winchkit.profile_edit.fitted.write_fitted` and :func:`~winchkit.profile_edit.ledger.undo`.
"""
