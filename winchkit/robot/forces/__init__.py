"""Forces of cable robots: balance, distribution on the cables, elongation."""
