"""``winchkit cell``: load cells and other slow instruments; no drive is touched."""
