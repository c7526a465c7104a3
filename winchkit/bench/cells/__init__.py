"""The slow instruments of a bench: readings, commands, tares and reports."""
