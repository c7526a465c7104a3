"""First process of the machine: mounts, CAN modules, interfaces, one command, power off."""

from __future__ import annotations

import ctypes
import errno
import json
import os
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Any

_POWER_OFF = 0x4321FEDC
_FINIT_MODULE = 313
_MOUNTS = (("proc", "/proc"), ("sysfs", "/sys"), ("devtmpfs", "/dev"), ("tmpfs", "/run"))
_MODULES = (
    "net/can/can.ko",
    "net/can/can-raw.ko",
    "net/can/can-bcm.ko",
    "drivers/net/can/dev/can-dev.ko",
    "drivers/net/can/vcan.ko",
)
_LIBC = ctypes.CDLL(None, use_errno=True)


def checked(result: int, what: str) -> None:
    if result != 0 and ctypes.get_errno() != errno.EBUSY:  # busy: the kernel has mounted it
        raise OSError(ctypes.get_errno(), what)


def prepare(job: dict[str, Any]) -> None:
    for kind, place in _MOUNTS:
        checked(
            _LIBC.mount(kind.encode(), place.encode(), kind.encode(), 0, None), f"mount {place}"
        )
    for name in _MODULES:
        path = Path(job["modules"]) / "kernel" / name
        with path.open("rb") as module:
            checked(_LIBC.syscall(_FINIT_MODULE, module.fileno(), b"", 0), f"load {name}")
    links = [["link", "set", "lo", "up"]]
    for channel in job["channels"]:
        links += [["link", "add", channel, "type", "vcan"], ["link", "set", channel, "up"]]
    for words in links:
        subprocess.run(["ip", *words], env=job["environment"], check=True)


def main(job: dict[str, Any]) -> None:
    code = 1
    with Path(job["output"]).open("wb") as output:
        try:
            prepare(job)
            done = subprocess.run(
                job["command"],
                cwd=job["folder"],
                env=job["environment"],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                check=False,
            )
            code = done.returncode
        except OSError:
            output.write(traceback.format_exc().encode())
    Path(job["status"]).write_text(str(code), encoding="utf-8")
    os.sync()
    _LIBC.reboot(_POWER_OFF)


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
