"""``winchkit cell``: what its commands print and do, against simulated devices."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from served import Served
from winchkit.bench.ownership import Ownership
from winchkit.cli.cell.group import command
from winchkit.errors import NoReply, NotPermitted, UsageError
from winchkit.schema.read import read_bench, read_calibration, read_tares


@pytest.fixture
def cell() -> Iterator[Served]:
    with Served("laumas-tlb") as served:
        yield served


def run(
    *arguments: str | Path, answers: str = "", error: type[BaseException] | None = None
) -> Result:
    result = CliRunner().invoke(command, [str(word) for word in arguments], input=answers)
    if error is None:
        assert isinstance(result.exception, SystemExit | None), result.exception
    else:
        assert isinstance(result.exception, error)
    return result


def told(*arguments: str | Path, answers: str = "") -> Any:
    return json.loads(run(*arguments, "--json", answers=answers).stdout.splitlines()[-1])


def test_info_names_the_device_and_its_reading(cell: Served, tmp_path: Path) -> None:
    bench = cell.bench(tmp_path)
    facts = told("info", "A", "-b", bench)
    assert facts["device"]["name"] == "laumas-tlb"
    assert facts["identity"]["serial number"] == 4711
    assert facts["reading"]["value"] == pytest.approx(100.0, abs=3)
    assert facts["timing"]["filter"] == pytest.approx(0.006)
    assert facts["timing"]["age"] > 0.006
    assert "serial number 4711" in run("info", "-b", bench).output


def test_rate_says_what_limits_it(cell: Served, tmp_path: Path) -> None:
    report = told("rate", "-b", cell.bench(tmp_path), "--for", "0.5s")
    assert report["limits"]["the device's conversions"] == 300.0
    assert "`rate` in the wiring" not in report["limits"]
    assert report["limits"][report["limited_by"]] == min(report["limits"].values())
    assert report["rate"] < 330.0, "no faster than it converts"
    slower = cell.bench(tmp_path, ', rate = "40 Hz"')
    report = told("rate", "-b", slower, "--for", "0.5s")
    assert report["limits"]["`rate` in the wiring"] == 40.0
    assert report["rate"] < 50.0
    text = run("rate", "-b", slower, "--for", "0.3s").output
    assert "300.0 /s  the device's conversions" in text
    assert "a reading keeps the line busy" in text


def test_diagnose_reports_noise_and_ends_with_zero(cell: Served, tmp_path: Path) -> None:
    result = run("diagnose", "-b", cell.bench(tmp_path), "--for", "1s")
    assert result.exit_code == 0
    assert "noise: 0.3" in result.output or "noise: 0.2" in result.output
    assert "saturated 0" in result.output


def test_diagnose_of_an_overloaded_cell_ends_with_one(cell: Served, tmp_path: Path) -> None:
    cell.cell.inject("overload")
    result = run("diagnose", "-b", cell.bench(tmp_path), "--for", "0.5s")
    assert result.exit_code == 1
    assert "overload" in result.output


def test_the_tare_of_the_host_lasts_and_leaves_the_device_alone(
    cell: Served, tmp_path: Path
) -> None:
    bench = cell.bench(tmp_path)
    result = told("tare", "-b", bench, "--for", "0.3s")
    assert result["before"] == pytest.approx(100.0, abs=1)
    assert result["after"] == pytest.approx(0.0, abs=1)
    book = read_tares(tmp_path / "bench.tares.toml")
    assert book.tare["A.cell"].value == pytest.approx(100.0, abs=1)
    facts = told("info", "-b", bench)
    assert facts["reading"]["value"] == pytest.approx(0.0, abs=3)
    assert facts["reading"]["gross"] == pytest.approx(100.0, abs=3)
    assert facts["tare"]["device"] is False
    assert cell.cell.stored == 0
    assert told("tare", "--clear", "-b", bench)["removed"] == pytest.approx(100.0, abs=1)
    assert told("info", "-b", bench)["reading"]["value"] == pytest.approx(100.0, abs=3)
    run("tare", "--clear", "-b", bench, error=UsageError)


def test_a_second_tare_adds_to_the_first(cell: Served, tmp_path: Path) -> None:
    bench = cell.bench(tmp_path)
    told("tare", "-b", bench, "--for", "0.2s")
    cell.force = 150.0
    assert told("tare", "-b", bench, "--for", "0.2s")["tare"] == pytest.approx(150.0, abs=1)


def test_the_device_tares_and_zeroes_itself(cell: Served, tmp_path: Path) -> None:
    cell.noise = 0.02  # it takes one noisy reading for its zero
    bench = cell.bench(tmp_path)
    assert told("zero", "-b", bench, "--for", "0.2s")["after"] == pytest.approx(0.0, abs=1)
    cell.force = 160.0
    result = told("tare", "--device", "-b", bench, "--for", "0.2s")
    assert result["before"] == pytest.approx(60.0, abs=1)
    assert told("info", "-b", bench)["tare"]["device"] is True
    result = told("tare", "--device", "--clear", "-b", bench, "--for", "0.2s")
    assert result["after"] == pytest.approx(60.0, abs=1)
    assert told("info", "-b", bench)["tare"]["device"] is False
    assert cell.cell.stored == 0


def test_a_zero_of_the_device_leaves_the_hosts_tare_and_says_so(
    cell: Served, tmp_path: Path
) -> None:
    bench = cell.bench(tmp_path)
    told("tare", "-b", bench, "--for", "0.2s")
    text = run("zero", "-b", bench, "--for", "0.2s").output
    assert "it reads -100" in text or "it reads -99" in text
    assert "the host's own tare of 100" in text or "the host's own tare of 99" in text


def test_a_time_below_zero_is_refused(cell: Served, tmp_path: Path) -> None:
    run("rate", "-b", cell.bench(tmp_path), "--for", "-3s", error=UsageError)


def test_the_eeprom_is_written_after_a_yes_only(cell: Served, tmp_path: Path) -> None:
    bench = cell.bench(tmp_path)
    CliRunner().invoke(command, ["store", "-b", str(bench)], input="n\n")
    assert cell.cell.stored == 0
    run("store", "-b", bench, answers="y\n")
    assert cell.cell.stored == 1
    run("store", "-b", bench, "--command", "tare", "--yes", error=NotPermitted)
    assert cell.cell.stored == 1


def test_a_guided_calibration_is_found_and_applied(cell: Served, tmp_path: Path) -> None:
    """The cell shows 2 % too little and 3 N too much; loads follow the operator's answers."""
    cell.noise, kilogram = 0.02, 9.80665
    bench = cell.bench(tmp_path)
    weights = [0, 2, 5, 10, 15, 10, 5, 2, 0]
    hung = iter([0.98 * kilogram * mass + 3.0 for mass in weights])

    class Hanging:
        """Hangs the next weight whenever the command waits for Enter."""

        def __call__(self, *_: object, **__: object) -> str:
            cell.force = next(hung)
            return ""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("click.prompt", Hanging())
        result = told(
            "calibrate", "A", "-b", bench, "--weights", "0 2 5 10 15 kg", "--series", "1",
            "--for", "0.3s", "--settle", "0.1s", "--temperature", "21 degC",
            "-o", tmp_path / "cell.toml", "--html", tmp_path / "cell.html", "--yes",
        )  # fmt: skip
    c0, c1 = result["fit"]["coefficients"]
    assert c1 == pytest.approx(1 / 0.98, rel=2e-3)
    assert c0 == pytest.approx(-3.0 / 0.98, abs=0.1)
    calibration = read_calibration(tmp_path / "cell.toml")
    assert calibration.serial_number == "4711"
    assert calibration.temperature == 21.0
    assert len(calibration.point) == 9
    assert "<svg" in (tmp_path / "cell.html").read_text()
    facts = told("info", "-b", cell.bench(tmp_path, ', calibration = "cell.toml"'))
    assert facts["reading"]["gross"] == pytest.approx(0.0, abs=0.3)
    assert facts["calibration"].startswith("cell of 20")


def test_a_calibration_that_is_not_accepted_writes_nothing(cell: Served, tmp_path: Path) -> None:
    points = tmp_path / "points.csv"
    points.write_text("load [kg],indicated [N]\n0,0\n1,9.8\n2,19.6\n5,49.1\n10,98.0\n")
    bench = cell.bench(tmp_path)
    CliRunner().invoke(
        command, ["calibrate", "A", "-b", str(bench), "--points", str(points)], input="n\n"
    )
    assert not list(tmp_path.glob("A*.toml"))
    run("calibrate", "A", "-b", bench, "--points", points, "--yes")
    assert read_calibration(tmp_path / "A-cell.toml").device == "laumas-tlb"


def test_points_need_neither_a_cell_nor_a_bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    points = tmp_path / "points.csv"
    rows = [f"{m},{1.02 * 9.80665 * m + 3:.4f},{s}" for s in (1, 2) for m in (0, 2, 5, 10, 15)]
    points.write_text("\n".join(["load [kg],reading [N],series", *rows]) + "\n")
    found = told("calibrate", "--points", points, "--yes")
    effects = {e["effect"]: e["value"] for e in found["diagnosis"]["effects"]}
    assert effects == pytest.approx({"cell-offset": 3.0, "cell-gain": 0.02}, abs=1e-4)
    calibration = read_calibration(tmp_path / "points-calibration.toml")
    assert calibration.coefficients[1] == pytest.approx(1 / 1.02, rel=1e-5)


def test_a_serial_number_can_be_given_and_weights_need_no_points(
    cell: Served, tmp_path: Path
) -> None:
    points = tmp_path / "points.csv"
    points.write_text("load [kg],indicated [N]\n0,0\n1,9.8\n2,19.6\n5,49.1\n10,98.0\n")
    bench = cell.bench(tmp_path)
    asked = ("calibrate", "A", "-b", bench, "--points", points, "--yes")
    run(*asked, "--serial", "K-17")
    assert read_calibration(tmp_path / "A-cell.toml").serial_number == "K-17"
    assert run(*asked, "--weights", "1 kg").exit_code == 2


def test_only_what_measures_a_force_is_calibrated(tmp_path: Path) -> None:
    with Served("laumas-tlb") as served:
        bench = served.bench(tmp_path)
    text = bench.read_text().replace("cell = {", "length = {")
    bench.write_text(text.replace('"laumas-tlb"', '"generic-length"'))
    points = tmp_path / "points.csv"
    points.write_text("load [kg],indicated [N]\n0,0\n1,9.8\n2,19.6\n")
    result = run("calibrate", "A.length", "-b", bench, "--points", points, "--yes")
    assert result.exit_code == 2
    assert "A.length measures no force" in result.output
    assert not list(tmp_path.glob("A*.toml"))


def test_an_unknown_cell_is_named_with_those_there_are(cell: Served, tmp_path: Path) -> None:
    result = run("info", "B", "-b", cell.bench(tmp_path), error=UsageError)
    assert "no instrument 'B'; the bench has A.cell" in str(result.exception)


@pytest.mark.parametrize("device", ["mantracourt-dsc", "generic-rs485", "pt113", "generic-modbus"])
def test_every_device_file_reads_its_simulated_device(device: str, tmp_path: Path) -> None:
    with Served(device) as served:
        facts = told("info", "-b", served.bench(tmp_path))
    assert facts["reading"]["value"] == pytest.approx(100.0, abs=3)
    assert facts["counters"]["timeouts"] == facts["counters"]["exceptions"] == 0


def test_a_bench_that_somebody_owns_is_left_alone(cell: Served, tmp_path: Path) -> None:
    bench = cell.bench(tmp_path)
    owner = Ownership(read_bench(bench))
    try:
        result = run("info", "-b", bench, error=NotPermitted)
        assert "is owned by process" in str(result.exception)
    finally:
        owner.close()
    run("info", "-b", bench)


def test_a_cell_that_is_switched_off_is_reported(tmp_path: Path) -> None:
    with Served("laumas-tlb") as served:
        bench = served.bench(tmp_path)
        served.cell.inject("silence")
        result = run("info", "-b", bench, error=NoReply)
    assert "check power, wiring, baud rate and unit number" in str(result.exception)
