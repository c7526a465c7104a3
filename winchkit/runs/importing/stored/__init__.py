"""Numbers as a file stores them: modulo a range, or without their sign."""
