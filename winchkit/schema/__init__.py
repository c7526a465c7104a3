"""Contents of declaration files as frozen dataclasses in SI.

``profiles`` has winches, robots and sizing specifications, ``devices`` drives and instruments,
``eds`` electronic data sheets, ``reading`` the reader of TOML. The functions that read a file are
in :mod:`winchkit.schema.read`.
"""
