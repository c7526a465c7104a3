"""A machine with real SocketCAN where this one's kernel has none.

Debian's ``user-mode-linux`` is a kernel that runs as an ordinary process. It is fetched by apt
into a cache outside the repository, boots on this machine's own files within seconds, and runs
one command with the CAN interfaces ``vcan0`` and ``vcan1``::

    python tests/support/socketcan/machine.py candump -n 1 vcan0
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

CHANNELS = ("vcan0", "vcan1")
PACKAGES = ("user-mode-linux", "can-utils")
INIT = Path(__file__).with_name("init.py")
_MEMORY = "1024M"


class Unavailable(Exception):
    """Why there can be no such machine here."""


@dataclass(frozen=True)
class Finished:
    """How a command ended in the machine."""

    returncode: int
    output: str


def cache() -> Path:
    """Where the unpacked packages stay."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "winchkit" / "socketcan"


def fetch() -> Path:
    """Folder with the unpacked packages; raises Unavailable with the reason."""
    folder = cache()
    if all((folder / "usr/bin" / name).is_file() for name in ("linux.uml", "candump")):
        return folder
    if sys.platform != "linux" or os.uname().machine != "x86_64":
        raise Unavailable("user-mode-linux is for Linux on x86_64")
    for tool in ("apt-get", "dpkg-deb", "ip"):
        if shutil.which(tool) is None:
            raise Unavailable(f"this machine has no {tool}")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as download:
        _download(download)
        for package in Path(download).glob("*.deb"):
            _checked(["dpkg-deb", "-x", str(package), str(folder)], download)
    return folder


def _download(folder: str) -> None:
    """Fetch the packages; the lists of packages may be older than they are."""
    try:
        _checked(["apt-get", "download", *PACKAGES], folder)
    except Unavailable:
        _checked(["apt-get", "update"], folder)
        _checked(["apt-get", "download", *PACKAGES], folder)


def _checked(command: list[str], folder: str) -> None:
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )
    if done.returncode != 0:
        raise Unavailable(f"{' '.join(command)}: {done.stderr.strip()}")


def run(command: list[str], *, timeout: float = 300.0) -> Finished:
    """Run a command in such a machine, in this directory and environment.

    The packages' programs are first on its path. Raises Unavailable where none boots,
    TimeoutError where the command does not end.
    """
    folder = fetch()
    modules = next((folder / "usr/lib/uml/modules").iterdir())
    with tempfile.TemporaryDirectory() as scratch:
        job = Path(scratch) / "job.json"
        output, status = Path(scratch) / "output", Path(scratch) / "status"
        search = f"{folder / 'usr/bin'}:{os.environ['PATH']}"
        asked = {
            "command": command,
            "folder": str(Path.cwd()),
            "environment": {**os.environ, "PATH": search, "TMPDIR": "/run"},
            "modules": str(modules),
            "channels": CHANNELS,
            "output": str(output),
            "status": str(status),
        }
        job.write_text(json.dumps(asked), encoding="utf-8")
        start = Path(scratch) / "init"
        start.write_text(f"#!/bin/sh\nexec {sys.executable} {INIT} {job}\n", encoding="utf-8")
        start.chmod(0o755)
        console = _boot(folder / "usr/bin/linux.uml", start, timeout)
        if not status.is_file():
            raise Unavailable(f"the machine did not come up:\n{console[-2000:]}")
        text = output.read_text(encoding="utf-8", errors="replace")
        return Finished(int(status.read_text()), text)


def _boot(kernel: Path, start: Path, timeout: float) -> str:
    """Boot, wait for the end, and return what the console said."""
    line = [f"mem={_MEMORY}", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "rw"]
    line += [f"init={start}", "con=null", "con0=null,fd:1", "quiet"]
    shared = Path("/dev/shm")
    memory = str(shared) if shared.is_dir() else tempfile.gettempdir()
    with subprocess.Popen(
        [str(kernel), *line],
        env={**os.environ, "TMPDIR": memory},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as machine:
        try:
            said, _ = machine.communicate(timeout=timeout)
        except subprocess.TimeoutExpired as error:
            # Its processes are processes of this machine too.
            os.killpg(machine.pid, signal.SIGKILL)
            raise TimeoutError(f"the machine did not end within {timeout:g} s") from error
    return said.decode("utf-8", "replace")


if __name__ == "__main__":
    finished = run(sys.argv[1:])
    sys.stdout.write(finished.output)
    sys.exit(finished.returncode)
