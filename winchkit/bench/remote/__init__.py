"""Stations: the processes that share a bench, and the process that owns it for them.

``operations`` is the table of what a station can do, ``server`` serves a ``station`` to each
``client``, ``commander`` grants each winch to one client, ``process`` is a bench process that ends
after its last client. The entry is :func:`winchkit.attach`.
"""
