"""Whole pages, one module for each subject, composed of figures, tables and sentences."""
