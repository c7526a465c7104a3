"""Pages and figures of robots."""
