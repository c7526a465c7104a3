"""Whole pages: one file for each subject, put together from figures, tables and sentences."""
