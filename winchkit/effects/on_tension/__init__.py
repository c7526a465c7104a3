"""Effects on the tension, from the load to the cell's reading, one per file."""
