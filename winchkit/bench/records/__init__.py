"""Records beside the bench file that outlive the process: latched trips, positions of the drives.

Every record is one file that is overwritten in place, or replaced as a whole.
"""
