"""What the page costs, in Debian's Chromium: ``python benchmarks/page_figures.py --json``.

Serves the page by ``winchkit serve`` and clicks through it: time to the first contents, processor
time of eight simulated winches live, drawing a million samples, brushing and adding at 54 000
samples, and time from a key press to the drive's RPDO. ``--small`` has fewer samples, one winch
and less time. Prints one JSON object. It needs Chromium, ``playwright`` and the extra ``web``; the
simulation runs in real time. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import can
from playwright.sync_api import Error, sync_playwright

from winchkit import write_run
from winchkit.catalog import find
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import read_bench, read_simbench
from winchkit.sim.bench import profiles_of
from winchkit.sim.record import simulate

EXAMPLE = "demo-fat-drum"
NAMES = "ABCDEFGH"
PARTS = ("refit", "draw", "live", "keys")
PATIENCE = 300_000
"""ms, for a diagnosis."""
LOADS = (10.0, 20.0)
TICKS = os.sysconf("SC_CLK_TCK")
RPDO = range(0x200, 0x280)
STALLS = """() => { window.stalls = []; let last = performance.now();
  const look = (now) => {
    window.stalls.push(now - last); last = now; requestAnimationFrame(look); };
  requestAnimationFrame(look); }"""
"""Times between frames of the browser, ms."""
SEEN = """() => { const at = performance.now(), old = document.querySelector("#time .u-over");
  window.drawn = null;
  const look = () => { const now = document.querySelector("#time .u-over");
    if (now && now !== old) window.drawn = performance.now() - at;
    else requestAnimationFrame(look); };
  requestAnimationFrame(look); }"""
"""Time until the curves are drawn again, ms."""
PRESSED = """() => addEventListener("keydown",
  (event) => { window.pressed = performance.timeOrigin + event.timeStamp; }, true)"""


@dataclass(frozen=True)
class Size:
    """How much is measured."""

    winches: int
    seconds: float
    """Of watching the live bench."""
    samples: int
    """Drawn."""
    diagnosed: int
    """Brushed and refitted."""
    presses: int


FULL = Size(8, 20.0, 1_000_000, 54_000, 20)
SMALL = Size(1, 2.0, 20_000, 4_000, 3)


def used(pid: int) -> float:
    """Processor time of a process, s."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def browsers() -> list[int]:
    """Processes of the browser: Chromium below this process."""
    parent, name = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            text = (folder / "stat").read_text(encoding="utf-8", errors="replace")
        except OSError:
            continue
        head, _, tail = text.rpartition(")")
        pid = int(folder.name)
        parent[pid], name[pid] = int(tail.split()[1]), head.partition("(")[2]
    below, grown = {os.getpid()}, True
    while grown:
        more = {pid for pid, of in parent.items() if of in below} - below
        grown = bool(more)
        below |= more
    return [pid for pid in below if "chrom" in name.get(pid, "")]


def until(page: Any, expression: str) -> None:
    """Wait until an expression of the page is true; the page's security policy has no other way."""
    while not page.evaluate(expression):
        page.wait_for_timeout(10)


@contextmanager
def command(*arguments: str, pipe: bool = False) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A command of winchkit while the block runs, and the first line that it prints."""
    process = subprocess.Popen(
        [sys.executable, "-m", "winchkit", *arguments],
        stdin=subprocess.PIPE if pipe else None,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.terminate()
        process.communicate(timeout=60)


def programme(samples: int) -> tuple[Programme, float]:
    """Strokes under two loads, twice, and the rate (Hz) at which they have that many samples."""
    steps = []
    for mass in LOADS:
        steps.append(ProgrammeStep(ask=f"hang the {mass:g} kg load", load_mass=mass))
        for to in (2.8, 1.5, 2.2, 1.0, 1.5):
            steps.append(ProgrammeStep(to=to, speed=0.5, acceleration=0.8))
    found = Programme("strokes", tuple(steps), repeat=2)
    bench = read_simbench(find("sim", EXAMPLE))
    rows = sum(len(run) for run in simulate(bench, profiles_of(bench), found, seed=1))
    return found, 50.0 * samples / rows


def recorded(samples: int, folder: Path) -> list[str]:
    """Files of runs with that many samples, the strokes repeated so that 500 Hz suffice."""
    bench = read_simbench(find("sim", EXAMPLE))
    strokes, rate = programme(samples)
    times = max(1, -(-int(rate) // 500))
    head, body = strokes.step[:1], strokes.step[1:6]
    second, rest = strokes.step[6:7], strokes.step[7:]
    longer = replace(strokes, step=(*head, *times * body, *second, *times * rest))
    paths = []
    for run in simulate(bench, profiles_of(bench), longer, seed=1, rate=rate / times):
        paths.append(folder / f"{run.name}.csv")
        write_run(run, paths[-1])
    return [str(path) for path in paths]


def bench_of(winches: int, folder: Path) -> Path:
    """The simulated bench with several of its winch."""
    text = find("sim", "demo-adequate").read_text(encoding="utf-8")
    head, _, winch = text.partition("[winch.A]")
    winch, _, noise = winch.partition("[noise]")
    winch = "[winch.A]" + winch
    parts = [head]
    for index, name in enumerate(NAMES[:winches]):
        own = winch.replace("winch.A", f"winch.{name}").replace("node = 1", f"node = {index + 1}")
        for unit in (3, 2, 1):
            own = own.replace(f"unit = {unit}", f"unit = {unit + 3 * index}")
        parts.append(own)
    path = folder / "several.toml"
    path.write_text("".join(parts) + "[noise]" + noise, encoding="utf-8")
    return path


def visible(browser: Any, url: str) -> float:
    """Time from the request to the first contents, s; the least of three."""
    found = []
    for _ in range(3):
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        page = context.new_page()
        page.goto(url)
        page.wait_for_selector("main h1")
        found.append(
            page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
        )
        context.close()
    return float(min(found)) / 1e3


def live(page: Any, url: str, pid: int, seconds: float) -> dict[str, float]:
    """Share of a core that the server and the browser use while a bench is live."""
    page.goto(f"{url}#bench")
    page.wait_for_selector("#values .value", timeout=PATIENCE)
    page.wait_for_timeout(2000)
    page.evaluate(
        "window.frames_of_bench = 0; new MutationObserver(() => window.frames_of_bench++)"
        ".observe(document.querySelector('#values'), { attributeFilter: ['data-time'] })"
    )
    pids = browsers()
    before, server, start = sum(map(used, pids)), used(pid), time.monotonic()
    page.wait_for_timeout(1000 * seconds)
    passed = time.monotonic() - start
    return {
        "server_core": (used(pid) - server) / passed,
        "browser_core": (sum(map(used, pids)) - before) / passed,
        "redrawn_per_s": page.evaluate("window.frames_of_bench") / passed,
    }


def key_press(page: Any, bench: Path, presses: int) -> dict[str, Any]:
    """Time from a key event in the browser to the first RPDO that differs, ms."""
    bus = next(item for item in read_bench(str(bench)).bus.values() if item.kind == "can")
    newest: dict[int, bytes] = {}
    changes: list[float] = []
    ended = threading.Event()

    def listen() -> None:
        with can.Bus(interface=bus.interface, channel=bus.channel, port=bus.port) as line:
            while not ended.is_set():
                frame = line.recv(0.1)
                if frame is not None and frame.arbitration_id in RPDO:
                    data = bytes(frame.data)
                    if newest.get(frame.arbitration_id, data) != data:
                        changes.append(1e3 * time.time())
                    newest[frame.arbitration_id] = data

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    page.click("#take")
    until(page, "document.querySelector('#role').innerText.includes('You command')")
    page.evaluate(PRESSED)
    page.on("dialog", lambda dialog: dialog.accept())
    found, trips = [], 0
    for number in range(presses):
        page.wait_for_timeout(1500)
        if page.locator("#reset").count():
            trips += 1
            page.click("#reset")
            page.wait_for_timeout(2000)
        changes.clear()
        key = "ArrowDown" if number % 2 else "ArrowUp"
        page.keyboard.down(key)
        page.wait_for_timeout(300)
        page.keyboard.up(key)
        pressed = page.evaluate("window.pressed")
        found += [at - pressed for at in changes if at > pressed][:1]
    ended.set()
    listener.join()
    found.sort()
    return {
        "presses": presses,
        "trips": trips,
        "answered": len(found),
        "median_ms": found[len(found) // 2] if found else None,
        "longest_ms": found[-1] if found else None,
    }


def drawn(page: Any, url: str) -> dict[str, float]:
    """Time to draw the whole record of another output, s; the least of four."""
    page.goto(url)
    start = time.monotonic()
    page.wait_for_selector("#time .u-over", timeout=PATIENCE)
    first, found = time.monotonic() - start, []
    page.wait_for_selector(".models .head", timeout=PATIENCE)
    for place in (1, 0, 1, 0):
        page.evaluate(SEEN)
        page.locator(".models .head").nth(place).click()
        until(page, "window.drawn !== null")
        found.append(page.evaluate("window.drawn") / 1e3)
    return {"drawn_s": min(found), "read_and_drawn_s": first}


def brushed(page: Any) -> dict[str, float]:
    """Longest time between two frames while samples are marked in six charts, ms."""
    page.wait_for_selector("#over .u-over", timeout=PATIENCE)
    page.wait_for_timeout(1000)
    box = page.locator("#over .u-over").first.bounding_box()
    page.evaluate(STALLS)
    for _ in range(4):
        page.mouse.move(box["x"] + 0.1 * box["width"], box["y"] + 20)
        page.mouse.down()
        for step in range(40):
            page.mouse.move(box["x"] + (0.1 + 0.02 * step) * box["width"], box["y"] + 30)
            page.wait_for_timeout(10)
        page.mouse.up()
        page.wait_for_timeout(300)
    assert "samples" in page.inner_text("#brush"), "nothing was marked"
    gaps = sorted(page.evaluate("window.stalls.slice(1)"))
    return {"longest_ms": gaps[-1], "p99_ms": gaps[int(0.99 * len(gaps))]}


def added(page: Any, pid: int) -> dict[str, float]:
    """Processor time of the server, and time, to add a candidate and refit."""
    before, start = used(pid), time.monotonic()
    page.keyboard.press("a")
    page.wait_for_selector(".name.history", timeout=PATIENCE)
    return {"cpu_s": used(pid) - before, "seconds": time.monotonic() - start}


NEW = {"viewport": {"width": 1280, "height": 900}}


def of_runs(browser: Any, samples: int, folder: Path, *, refit: bool) -> dict[str, Any]:
    """Drawing of runs with that many samples; with ``refit`` brushing and adding too."""
    profile = next(iter(profiles_of(read_simbench(find("sim", EXAMPLE))).values())).name
    paths = recorded(samples, folder)
    with command("serve", "--no-browser", *paths, "-p", profile) as (process, url):
        page = browser.new_page(**NEW)
        page.set_default_timeout(PATIENCE)
        out: dict[str, Any] = drawn(page, url)
        out["samples"] = page.evaluate(
            "fetch('/api/view' + location.search).then((r) => r.json())"
            ".then((v) => v.runs.reduce((sum, run) => sum + run.samples, 0))"
        )
        if refit:
            out["visible_s"] = visible(browser, url)
            out["brush"] = brushed(page)
            out["add"] = added(page, process.pid)
        page.close()
    return out


def of_bench(
    browser: Any, winches: int, folder: Path, seconds: float, presses: int
) -> dict[str, Any]:
    """Processor time of a live bench, and times from a key press to the drive."""
    declared, bench = bench_of(winches, folder), folder / f"bench-{winches}.toml"
    simulated = ("sim", "serve", str(declared), "--json", "-o", str(bench))
    with (
        command(*simulated, pipe=True),
        command("serve", "--no-browser", "-b", str(bench), "--allow-motion") as (process, url),
    ):
        page = browser.new_page(**NEW)
        page.set_default_timeout(PATIENCE)
        out: dict[str, Any] = dict(live(page, url, process.pid, seconds))
        if presses:
            out |= key_press(page, bench, presses)
        page.close()
    return out


def figures(browser: Any, size: Size, folder: Path, parts: Sequence[str]) -> dict[str, Any]:
    """Each part with the load of the computer; what fails is reported and the others go on."""
    measure: dict[str, Callable[[Path], dict[str, Any]]] = {
        "refit": lambda own: of_runs(browser, size.diagnosed, own, refit=True),
        "draw": lambda own: of_runs(browser, size.samples, own, refit=False),
        "live": lambda own: of_bench(browser, size.winches, own, size.seconds, 0),
        "keys": lambda own: of_bench(browser, 1, own, size.seconds, size.presses),
    }
    out: dict[str, Any] = {"schema": 1, "size": size.__dict__}
    for name in parts or measure:
        own = folder / name
        own.mkdir()
        load = os.getloadavg()[0]
        try:
            out[name] = measure[name](own)
        except (Error, AssertionError) as error:
            out[name] = {"error": str(error).partition("\n")[0]}
        out[name]["load"] = [load, os.getloadavg()[0]]
        print(name, json.dumps(out[name]), file=sys.stderr, flush=True)
    return out


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--small", action="store_true", help="few samples, one winch, seconds")
    parser.add_argument("--only", nargs="*", default=(), choices=PARTS, help="parts to measure")
    parser.add_argument("--json", action="store_true", help="it always prints JSON")
    args = parser.parse_args()
    chromium = shutil.which("chromium")
    if chromium is None:
        sys.exit("no Chromium: apt-get install chromium")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        found = figures(browser, SMALL if args.small else FULL, Path(folder), args.only)
        browser.close()
    print(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
