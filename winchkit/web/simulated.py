"""A simulated bench in a process of its own, which ends with this one."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from winchkit.catalog import find
from winchkit.errors import ConnectionLost

_TIMEOUT = 30.0
"""For a simulated bench to start, s."""
_ENDING = 0.5
"""For a simulated bench to end, s; after that it ends by itself."""


class simulated_bench:
    """Runs a simulated bench in a process of its own; gives its bench file."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        self.file = folder / f"{Path(name).stem}-bench.toml"
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> str:
        find("sim", self.name)
        command = [sys.executable, "-m", "winchkit", "sim", "serve", self.name, "--json"]
        self._process = subprocess.Popen(
            # Its input is a pipe, which closes with this process however that ends.
            [*command, "--end-with-input", "--bench-file", str(self.file)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait(_TIMEOUT)
            raise ConnectionLost(
                f"the simulated bench '{self.name}' did not start; "
                f"'winchkit sim serve {self.name}' says why"
            )
        return str(json.loads(line)["bench"])

    def __exit__(self, *_: object) -> None:
        process = self._process
        if process is None:
            return
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.communicate(timeout=_ENDING)
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                stream.close()
