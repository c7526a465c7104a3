"""Writers of logs of a bench: by channels (MCAP) or by rows (CSV), in parts, with file locks."""
