"""Commands at a bench: jog, move, home, run, monitor, tare, stop, reset and commission.

Each attaches to the owner of the bench, or starts a bench process; ``keyboard_jog`` and
``direction_option`` are what several of them use.
"""
