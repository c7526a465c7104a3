"""Records beside the bench file that outlive the process: latched trips, positions of drives."""
