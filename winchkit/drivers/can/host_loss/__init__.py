"""Detection of a lost host by a drive: mechanisms, their set-up and their proof.

``cyclic``, ``guarding`` and ``vendor`` are mechanisms, ``proof`` tests them by silence, ``watch``
supervises drive and host in the control loop.
:class:`~winchkit.drivers.can.host_loss.watch.HostWatch` is the entry.
"""
