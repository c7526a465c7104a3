"""Frames that wait for a busy process act at the instants at which they arrived."""

from __future__ import annotations

from itertools import pairwise

from winchkit.sim.live.buses import serve


class LatePort:
    """Frames by the time of their arrival, taken by a process that was away until ``clock``."""

    def __init__(self, arrivals: list[float]) -> None:
        self.clock = max(arrivals) + 0.03
        self.waiting = sorted(arrivals)
        self.waited = 0.0

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """The next frame; without one, time passes."""
        if not self.waiting:
            self.waited = 0.0
            self.clock += timeout
            return None
        self.waited = self.clock - self.waiting.pop(0)
        return 0x80, b""


def test_late_frames_and_ticks_beside_them_keep_their_instants() -> None:
    arrivals = [0.004 * k for k in range(1, 10)]
    port = LatePort(arrivals)
    told: list[tuple[str, float]] = []

    def deliver(_identifier: int, _data: bytes, ago: float) -> None:
        told.append(("frame", port.clock - ago))
        port.clock += 1e-3  # what it takes

    serve(
        port,  # type: ignore[arg-type]
        lambda: port.clock,
        lambda: port.clock > 0.1,
        deliver=deliver,
        tick=lambda heard, ago: told.append(("heard" if heard else "tick", port.clock - ago)),
        late=lambda _lateness: None,
    )
    frames = [time for what, time in told if what == "frame"]
    assert max(abs(time - arrival) for time, arrival in zip(frames, arrivals, strict=True)) < 1e-12
    times = [time for _, time in told]
    assert all(later - earlier > -1e-3 for earlier, later in pairwise(times))
    assert [what for what, _ in told if what != "frame"][-1] == "heard"
