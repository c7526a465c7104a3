"""The physics of a winch and its cable, numpy only.

``drum`` computes the wound length from the drum angle; ``friction`` has the friction laws of a
pulley, ``pulleys`` chains of pulleys; ``recurrence`` has the operators with memory; ``line``
combines all of them into predictions of a winch, ``robot`` those of a cable robot. ``capacity``,
``guide``, ``gearbox`` and ``sizing`` have the design equations of a winch.
"""
