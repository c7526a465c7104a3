"""Pages and texts of fleets."""
