"""Units as other programs write them.

``known`` has the spellings and composes those of torques and speeds; ``spelling`` reads them from
the cells of a header.
"""
