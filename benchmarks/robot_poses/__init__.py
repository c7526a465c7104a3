"""A robot as it truly is, and the nested method that calibrates it slowly."""
