"""Effects on robots: their files, their binding to a profile, the standard poses."""
