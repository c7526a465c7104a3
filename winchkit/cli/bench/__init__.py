"""Commands that move, watch or stop a bench."""
