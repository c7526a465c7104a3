"""SDO replies that answer another request: a late one to a stop by SDO, or to another client."""

from __future__ import annotations

import pytest

from slave.rig import Rig

STRAYS = {
    "write of 6040h": "6040600000000000",
    "write of the same object": "607C600000000000",
    "read of 6041h": "4B41600037060000",
    "abort of 6040h": "8040600022000008",
}


@pytest.mark.parametrize("stray", STRAYS)
@pytest.mark.parametrize("after", [0.005, 0.02])
def test_a_transfer_takes_its_own_reply_only(rig: Rig, stray: str, after: float) -> None:
    with rig.opened() as bench:
        node = bench.axes["A"].objects
        node.write(0x607C, 0, 4711)
        rig.slaves[0].inject("sdo delayed", 0.03)
        frame = bytes.fromhex(STRAYS[stray])
        rig.clock.call_at(rig.time + after, lambda: rig.from_stranger(0x581, frame))
        assert node.read(0x607C) == 4711
        rig.clock.call_at(rig.time + after, lambda: rig.from_stranger(0x581, frame))
        if stray != "write of the same object":  # which is its own
            node.write(0x607C, 0, 12)
            assert node.read(0x607C) == 12
        assert not bench.snapshot.tripped
