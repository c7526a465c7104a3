"""Random faults of a moving bench, judged from the truth: see ``benchmarks/fault_campaign.py``."""
