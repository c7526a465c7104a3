"""Diagnosis: which physical effects a model lacks, by comparison with measured runs."""
