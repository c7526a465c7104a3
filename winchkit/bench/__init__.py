"""An open bench: winches, control loop, supervision, logs, and motion programmes.

``control`` is the control loop, ``drives``, ``cells`` and ``recording`` the devices and logs around
it, ``records`` what outlives the process, ``commissioning`` the record that permits motion,
``remote`` the processes that share a bench. The platform that winches move together is the
robot's wing's. The public functions are :func:`winchkit.open_bench` and :func:`winchkit.attach`.
"""
