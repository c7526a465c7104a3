"""Several winches of one kind: a diagnosis each, and random-effects meta-analysis of them."""
