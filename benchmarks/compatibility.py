"""Short tests with other versions of Python and of the dependencies, in new environments.

``python benchmarks/compatibility.py`` runs them with every Python from 3.11 on that is found, with
the newest dependencies, then with the oldest ones that pyproject.toml permits. ``--python 3.12
--bounds newest`` runs one combination; ``--pymodbus`` runs the tests of Modbus with each minor
version of pymodbus in its range; ``--extras`` the main command of each extra in an environment with
this extra only, newest and oldest. Prints one line for each and exits with 1 where one fails.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
PYMODBUS = ("3.13.0", "3.14.0", "3.15.0", "3.16.1")
"""One version for each minor version of pymodbus that the package permits."""
OLDEST_TESTS = ("cli/core", "effects", "model", "runs", "schema", "repository/test_public_names.py")
"""Folders of tests for the oldest dependencies: files, numbers, the command line."""
MODBUS_TESTS = ("drivers/modbus", "sim/instruments/test_modbus_line.py")
EXTRAS = {
    "parquet": "parquet",
    "xlsx": "xlsx",
    "hdf5": "hdf5",
    "ros2": "ros2",
    "mf4": "mf4",
    "tdms": "tdms",
    "plot": "plot",
    "pandas": "pandas",
    "web": "web",
    "library": "library",
    "cluster": "library,cluster",
    "fast": "fast",
    "docs": "docs",
}
"""Extras that the main command of an extra needs; ``dev`` is that of all other tests."""
TEST_TOOLS = ("pytest>=8", "pytest-timeout", "pytest-xdist", "hypothesis")
_REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)>=(?P<oldest>[\d.]+)")


def oldest(*extras: str) -> list[str]:
    """Requirements that pin every dependency, also of these extras, to its lower bound."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    texts = list(settings["dependencies"])
    for extra in extras:
        texts += settings["optional-dependencies"][extra]
    found = []
    for text in texts:
        match = _REQUIREMENT.match(text)
        if match is None:
            raise SystemExit(f"pyproject.toml: '{text}' has no lower bound")
        found.append(f"{match['name']}=={match['oldest']}")
    return found


def interpreters(wanted: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Version and path of each interpreter: on the path, or one of pyenv's."""
    for version in wanted:
        found = shutil.which(f"python{version}")
        if found is None or not _runs(found, version):
            pyenv = shutil.which("pyenv")
            root = os.environ.get("PYENV_ROOT") or (Path(pyenv).parents[1] if pyenv else "")
            kept = sorted(Path(root).glob(f"versions/{version}.*/bin/python{version}"))
            found = str(kept[-1]) if root and kept else None
        if found is None and sys.version.startswith(f"{version}."):
            found = sys.executable
        if found is None:
            print(f"Python {version}: not found, not tested")
            continue
        yield version, found


def _runs(program: str, version: str) -> bool:
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    return done.returncode == 0 and f" {version}." in done.stdout


def tested(label: str, interpreter: str, requirements: Sequence[str], tests: Sequence[str]) -> bool:
    """Whether the tests pass in a new environment; those of an extra (``-k``) without a skip."""
    with tempfile.TemporaryDirectory(prefix="winchkit-") as folder:
        subprocess.run([interpreter, "-m", "venv", folder], check=True)
        python = str(Path(folder) / ("Scripts/python" if os.name == "nt" else "bin/python"))
        pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        installed = subprocess.run(
            [*pip, *requirements], capture_output=True, text=True, check=False
        )
        if installed.returncode:
            print(f"{label}: cannot be installed: {installed.stderr.strip()[-400:]}")
            return False
        done = subprocess.run(
            [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", *tests],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
    lines = done.stdout.strip().splitlines()
    for line in lines:
        if line.startswith(("FAILED ", "ERROR tests")):
            print(f"{label}: {line}")
    print(f"{label}: {lines[-1] if lines else done.stderr[-400:]}", flush=True)
    return done.returncode == 0 and not ("-k" in tests and "skipped" in lines[-1])


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--python", nargs="*", default=None, metavar="VERSION")
    parser.add_argument("--bounds", choices=("newest", "oldest"), default=None)
    parser.add_argument("--pymodbus", nargs="*", default=None, metavar="VERSION")
    parser.add_argument("--extras", nargs="*", default=None, metavar="EXTRA", choices=EXTRAS)
    parser.add_argument("--tests", nargs="*", default=None, help="below tests/, in place of all")
    asked = parser.parse_args()
    found = list(interpreters(asked.python or VERSIONS))
    if not found:
        raise SystemExit("no interpreter")

    def under(names: Sequence[str]) -> list[str]:
        return [f"tests/{name}" for name in asked.tests or names]

    passed = []
    if asked.pymodbus is not None:
        version, path = found[0]
        for release in asked.pymodbus or PYMODBUS:
            label = f"pymodbus {release}, Python {version}"
            wanted = (str(ROOT), f"pymodbus=={release}", *TEST_TOOLS)
            passed.append(tested(label, path, wanted, under(MODBUS_TESTS)))
        sys.exit(not all(passed))
    if asked.extras is not None:
        version, path = found[0]
        bounds = [asked.bounds] if asked.bounds else ["newest", "oldest"]
        for extra in asked.extras or EXTRAS:
            needed = EXTRAS[extra]
            file = "tests/repository/test_site.py" if extra == "docs" else "tests/test_extras.py"
            choice = (file, "-k", "the_site_is_built" if extra == "docs" else extra)
            for bound in bounds:
                pins = oldest(*needed.split(",")) if bound == "oldest" else ()
                wanted = (f"{ROOT}[{needed}]", *pins, *TEST_TOOLS)
                label = f"extra {extra}, Python {version}, {bound}"
                passed.append(tested(label, path, wanted, (*choice, "-m", "slow or not slow")))
        sys.exit(not all(passed))
    for version, path in found if asked.bounds != "oldest" else []:
        wanted = (f"{ROOT}[dev]",)
        passed.append(tested(f"Python {version}, newest", path, wanted, under([""])))
    if asked.bounds != "newest":
        version, path = found[0]
        wanted = (str(ROOT), *oldest(), *TEST_TOOLS)
        passed.append(tested(f"Python {version}, oldest", path, wanted, under(OLDEST_TESTS)))
    sys.exit(not all(passed))


if __name__ == "__main__":
    main()
