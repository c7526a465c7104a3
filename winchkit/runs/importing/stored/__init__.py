"""Numbers as a file stores them: modulo a range, or without their sign.

``numbers`` unwraps them, ``sign_bits`` restores signs, ``settling`` decides per column which of it
applies, or asks.
"""
