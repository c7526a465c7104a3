"""Effects on the way from the load to the cell's reading, one a file."""
