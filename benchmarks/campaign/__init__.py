"""The campaign's own winches, physics and scores; nothing here but ``score`` knows winchkit."""
