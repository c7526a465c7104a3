"""Effects of robots: geometry, home lengths and payload."""
