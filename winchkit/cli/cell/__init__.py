"""``winchkit cell``: load cells and other slow instruments; no drive is commanded.

``group`` lists the commands, ``options`` has what they share.
"""
