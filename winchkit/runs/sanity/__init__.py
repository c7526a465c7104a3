"""Sanity of recorded channels: sampling, resolution, saturation, outliers, filters of loggers.

Every file tests one property of a channel or of the time stamps without any model of the winch, and
returns findings with codes; ``docs/diagnosis.md`` lists the codes.
"""
