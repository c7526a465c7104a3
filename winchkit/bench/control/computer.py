"""Real-time settings that this computer permits: priority, locked memory, kernel settings.

Linux only; elsewhere every item is refused and says so. Nothing here changes the computer, and
:func:`survey` leaves the process as it was.
"""

from __future__ import annotations

import gzip
import os
import sys
import threading
from dataclasses import dataclass
from pathlib import Path

PRIORITY = 50
"""SCHED_FIFO priority of the control thread and of the receive threads of CAN buses."""
_CAPABILITY_LOCK = 14
"""CAP_IPC_LOCK, bit of the process's effective capabilities."""
_PREEMPTION = {
    "CONFIG_PREEMPT_NONE": "none",
    "CONFIG_PREEMPT_VOLUNTARY": "voluntary",
    "CONFIG_PREEMPT_LAZY": "lazy",
    "CONFIG_PREEMPT": "full",
}
_THROTTLED = 0.95
"""Usual share of processor time that the kernel leaves to real-time threads."""


@dataclass(frozen=True)
class ComputerSetting:
    """One setting, whether the control loop can use it, and how to change it."""

    name: str
    granted: bool
    detail: str
    """Present value, in words."""
    remedy: str = ""
    """The setting that permits it; empty where it is granted."""

    def __str__(self) -> str:
        """``memory: not locked: limit 8 MB; set ...``."""
        return f"{self.name}: {self.detail}" + (f"; {self.remedy}" if self.remedy else "")


def survey() -> tuple[ComputerSetting, ...]:
    """Real-time settings that a control loop would get on this computer with this account."""
    if sys.platform != "linux":
        return (
            ComputerSetting("real-time", False, f"not available on {sys.platform}", "use Linux"),
        )
    return (_scheduling(), _memory(), *_kernel())


def instrument_reading(*, scheduled: bool) -> ComputerSetting:
    """Process that reads the instruments of Modbus and serial lines, with real time requested."""
    process = "Modbus and serial lines are read by the instrument process"
    if scheduled:
        return ComputerSetting("instruments", True, f"{process}, with real-time priority")
    detail = (
        f"{process}, without real-time priority: other programs delay its readings, and a winch "
        "whose load cell is read too late trips"
    )
    return ComputerSetting("instruments", False, detail, scheduling_remedy())


def scheduling_remedy() -> str:
    """The setting that permits SCHED_FIFO to this account."""
    if _realtime_group_is_empty():
        return (
            "the control group of this session has no real-time budget: write 950000 to its "
            "cpu.rt_runtime_us"
        )
    return (
        f"in /etc/security/limits.conf: '@winch - rtprio {PRIORITY}' for the group of your "
        "account, then log in again (or grant CAP_SYS_NICE)"
    )


def memory_remedy() -> str:
    """The setting that permits locked memory to this account."""
    return (
        "in /etc/security/limits.conf: '@winch - memlock unlimited' for the group of your "
        "account, then log in again (or grant CAP_IPC_LOCK)"
    )


def threads(process: int | None = None) -> list[int]:
    """Native ids of the threads of a process, by default this one; none where it has ended."""
    try:
        return [int(name) for name in os.listdir(f"/proc/{process or 'self'}/task")]
    except (FileNotFoundError, ProcessLookupError):
        return []


def locks_without_limit(hard: int) -> bool:
    """Whether this account may lock any amount of memory, given RLIMIT_MEMLOCK."""
    import resource

    effective = int(_status("CapEff") or "0", 16)
    return hard == resource.RLIM_INFINITY or bool(effective >> _CAPABILITY_LOCK & 1)


def _scheduling() -> ComputerSetting:
    """Set the priority of a thread made for this test."""
    refusals: list[OSError] = []

    def attempt() -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        except OSError as error:
            refusals.append(error)

    thread = threading.Thread(target=attempt)
    thread.start()
    thread.join()
    if not refusals:
        return ComputerSetting(
            "scheduling", True, f"SCHED_FIFO with priority {PRIORITY} is permitted"
        )
    detail = f"SCHED_FIFO with priority {PRIORITY} is refused ({refusals[0].strerror})"
    return ComputerSetting("scheduling", False, detail, scheduling_remedy())


def _memory() -> ComputerSetting:
    """By limit and capability: locking the memory of this process only to see would cost time."""
    import resource

    hard = resource.getrlimit(resource.RLIMIT_MEMLOCK)[1]
    if locks_without_limit(hard):
        return ComputerSetting("memory", True, "may be locked")
    used = int((_status("VmSize") or "0").split()[0]) * 1024
    detail = f"may be locked up to {hard / 2**20:.0f} MB"
    if used < hard:
        return ComputerSetting("memory", True, detail)
    return ComputerSetting(
        "memory", False, f"{detail}, this process has {used / 2**20:.0f} MB", memory_remedy()
    )


def _kernel() -> tuple[ComputerSetting, ...]:
    """Settings of the kernel that hold back real-time threads or slow the processor down."""
    found = []
    preemption = _preemption()
    if preemption in ("none", "voluntary", "lazy"):
        found.append(
            ComputerSetting(
                "kernel preemption",
                False,
                f"{preemption}: a system call of another program delays the control loop by "
                "milliseconds",
                "boot with preempt=full, or a kernel with PREEMPT_RT",
            )
        )
    elif preemption:
        found.append(ComputerSetting("kernel preemption", True, preemption))
    runtime = _number("/proc/sys/kernel/sched_rt_runtime_us")
    period = _number("/proc/sys/kernel/sched_rt_period_us")
    if runtime is not None and period:
        found.append(_limit(runtime, period))
    governor = _text("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
    if governor and governor != "performance":
        found.append(
            ComputerSetting(
                "processor",
                False,
                f"its frequency follows the load (governor {governor})",
                "cpupower frequency-set -g performance",
            )
        )
    return tuple(found)


def _limit(runtime: int, period: int) -> ComputerSetting:
    """How long real-time threads may run on a processor within a period, us; -1 for no limit."""
    if not 0 <= runtime < period:
        return ComputerSetting(
            "kernel", True, "no limit of real-time threads by sched_rt_runtime_us"
        )
    detail = f"real-time threads get {runtime} of {period} us on each processor"
    if runtime < _THROTTLED * period:
        return ComputerSetting(
            "kernel", False, detail, "sysctl -w kernel.sched_rt_runtime_us=950000"
        )
    rest = (period - runtime) / 1000
    return ComputerSetting(
        "kernel",
        True,
        f"{detail}; threads that ask for more make the control loop stand still for {rest:.0f} ms",
    )


def _preemption() -> str:
    """Preemption model of the running kernel; empty where it is not known."""
    release = os.uname()
    if "PREEMPT_RT" in release.version:
        return "PREEMPT_RT"
    for word in (_text("/proc/cmdline") or "").split():
        if word.startswith("preempt="):
            return word.removeprefix("preempt=")
    for line in _kernel_configuration(release.release):
        key, _, value = line.partition("=")
        if value == "y" and key in _PREEMPTION:
            return _PREEMPTION[key]
    return ""


def _kernel_configuration(release: str) -> list[str]:
    try:
        with gzip.open("/proc/config.gz", "rt") as file:
            return file.read().splitlines()
    except OSError:
        return (_text(f"/boot/config-{release}") or "").splitlines()


def _realtime_group_is_empty() -> bool:
    """Whether the control group of this process gets no real-time budget (cgroup v1)."""
    for line in (_text("/proc/self/cgroup") or "").splitlines():
        _, controllers, path = line.split(":", 2)
        if "cpu" in controllers.split(","):
            return _number(f"/sys/fs/cgroup/cpu{path}/cpu.rt_runtime_us") == 0
    return False


def _status(key: str) -> str | None:
    for line in (_text("/proc/self/status") or "").splitlines():
        name, _, value = line.partition(":")
        if name == key:
            return value.strip()
    return None


def _number(path: str) -> int | None:
    text = _text(path)
    try:
        return None if text is None else int(text)
    except ValueError:
        return None


def _text(path: str) -> str | None:
    try:
        return Path(path).read_text().strip()
    except OSError:
        return None
