"""Logs that were cut off or damaged: everything whole is saved, wherever the cut was."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from logs import DRIVE, written
from winchkit.errors import FileError, RunError, UsageError
from winchkit.runs import open_writer, read_run
from winchkit.runs.read import read_log
from winchkit.runs.recover import recover


@pytest.fixture
def data(tmp_path: Path) -> bytes:
    written(tmp_path / "a.mcap", duration=1.0)
    return (tmp_path / "a.mcap").read_bytes()


@pytest.mark.slow
def test_recover_never_fails_on_a_cut_log(tmp_path: Path, data: bytes) -> None:
    path, saved = tmp_path / "cut.mcap", tmp_path / "saved.mcap"
    kept = 0
    for length in [*range(1, 300), *range(300, len(data), 131), len(data)]:
        path.write_bytes(data[:length])
        try:
            found = recover(path, saved, replace=True)
        except RunError as error:
            assert "nothing to recover" in str(error)  # noqa: PT017 - of some lengths
            assert not kept, "a longer file has as much"
            assert not saved.exists()
            continue
        assert found.kept >= kept, "a longer file has as much"
        assert found.dropped_pieces == 0
        assert found.was_whole is (length == len(data))
        kept = found.kept
        if b"winchkit.log" in data[:length] and kept:
            assert read_log(saved).closed
            assert read_log(path).span == read_log(saved).span
    assert kept == 250 + 50 + 11 + 1


def test_a_damaged_chunk_is_left_out_and_the_others_are_kept(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "hurt.mcap"
    whole = read_log(tmp_path / "a.mcap").samples[DRIVE]
    third = [n for n in range(len(data)) if data.startswith(b"\x04\0\0\0zstd", n)][3]
    hurt = bytearray(data)
    hurt[third + 40] ^= 0x55
    path.write_bytes(hurt)
    with pytest.raises(RunError, match=r"damaged.*winchkit log recover"):
        read_run(path)
    found = recover(path)
    assert found.output == str(tmp_path / "hurt.recovered.mcap")
    assert (found.dropped_pieces, found.was_whole) == (1, False)
    left = read_log(found.output).samples[DRIVE]
    assert len(left) == len(whole) - 25
    assert np.isin(left.times, whole.times).all()


@pytest.mark.parametrize("seed", range(8))
def test_garbage_in_the_middle_costs_what_it_covers(tmp_path: Path, data: bytes, seed: int) -> None:
    chance = random.Random(seed)
    path = tmp_path / "hurt.mcap"
    start = data.index(b"winchkit.log") + 3000
    at = chance.randrange(start, len(data) - 4000)
    hurt = data[:at] + chance.randbytes(300) + data[at + 300 :]
    path.write_bytes(hurt)
    found = recover(path)
    left = read_log(found.output).samples[DRIVE]
    assert len(left) >= 250 - 3 * 25
    assert not found.was_whole


def test_a_run_of_rows_is_recovered_too(tmp_path: Path) -> None:
    path = tmp_path / "rows.mcap"
    with open_writer(path, [("time", "s"), ("motor_angle", "rad")], {"a": "b"}) as writer:
        for n in range(20):
            writer.append({"time": n, "motor_angle": 2 * n})
    path.write_bytes(path.read_bytes()[:-700])
    cut = read_run(path)
    found = recover(path)
    again = read_run(found.output)
    assert again["motor_angle"].tolist() == cut["motor_angle"].tolist()
    assert again.notes == ()
    assert cut.notes != ()


def test_rows_of_text_are_recovered(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    with open_writer(path, [("time", "s"), ("motor_angle", "rad")], {"a": "b"}) as writer:
        for n in range(20):
            writer.append({"time": n / 7, "motor_angle": n / 3})
    data = path.read_bytes()
    for length in range(len(data) + 1):
        path.write_bytes(data[:length])
        rows = max(data[:length].count(b"\n") - 3, 0)
        if not rows:
            with pytest.raises(RunError, match="nothing to recover"):
                recover(path, replace=True)
            continue
        found = recover(path, replace=True)
        assert found.dropped_pieces == 0
        assert found.kept == rows
        assert found.dropped_bytes == length - data[:length].rfind(b"\n") - 1
        if found.kept > 1:
            run = read_run(found.output)
            assert run["motor_angle"].tolist() == [n / 3 for n in range(found.kept)]
            assert run.metadata["a"] == "b"


def test_rows_that_a_failing_disk_left(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    path.write_bytes(
        b"# a: b\ntime [s],motor_angle [rad]\n0,1\n0.1,\n"
        b"\0\0\0\0\n0.2\n0.3,4\n0.2,4\nx,y\n0.4,5\n0.5"
    )
    found = recover(path)
    assert (found.kept, found.dropped_pieces, found.dropped_bytes) == (4, 4, 3)
    assert read_run(found.output).time.tolist() == [0.0, 0.1, 0.3, 0.4]


def test_what_cannot_be_recovered(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.mcap"
    with pytest.raises(UsageError, match="would replace"):
        recover(path, path)
    (tmp_path / "a.recovered.mcap").write_bytes(b"recovered before")
    with pytest.raises(UsageError, match="exists already"):
        recover(path)
    assert (tmp_path / "a.recovered.mcap").read_bytes() == b"recovered before"
    with pytest.raises(RunError, match="no such file"):
        recover(tmp_path / "none.mcap")
    with pytest.raises(FileError, match="cannot be written"):
        recover(path, tmp_path / "nowhere" / "b.mcap")
    (tmp_path / "b.mcap").write_text("time [s]\n")
    with pytest.raises(RunError, match="not an MCAP file"):
        recover(tmp_path / "b.mcap")
    (tmp_path / "b.txt").write_text("x")
    with pytest.raises(RunError, match="no format of a log"):
        recover(tmp_path / "b.txt")
    assert path.read_bytes() == data


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full disk")
def test_what_cannot_be_saved_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = tmp_path / "a.mcap", tmp_path / "saved.mcap"
    written(source, 0.3)
    target.write_bytes(b"what was there")

    def full(_self: Path, data: bytes) -> int:
        with Path("/dev/full").open("wb", buffering=0) as disk:
            return disk.write(data)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        with pytest.raises(FileError, match="No space left"):
            recover(source, target, replace=True)
    assert target.read_bytes() == b"what was there"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "saved.mcap"]


def _joined(folder: Path, suffix: str, share: float) -> Path:
    """Two logs in one file, of the first a share."""
    written(folder / f"a.{suffix}", duration=1.0)
    written(folder / f"b.{suffix}", duration=2.0)
    first = (folder / f"a.{suffix}").read_bytes()
    path = folder / f"both.{suffix}"
    path.write_bytes(first[: int(share * len(first))] + (folder / f"b.{suffix}").read_bytes())
    return path


@pytest.mark.parametrize("suffix", ["mcap", "csv"])
@pytest.mark.parametrize("share", [1.0, 0.7, 0.65])
def test_logs_that_were_joined_are_both_recovered(
    tmp_path: Path, suffix: str, share: float
) -> None:
    path = _joined(tmp_path, suffix, share)
    with pytest.raises(RunError, match=r"another log was joined to it.*winchkit log recover"):
        read_run(path)
    found = recover(path)
    (other,) = found.further
    assert other.output == str(tmp_path / f"both.recovered-2.{suffix}")
    assert other.was_whole
    assert found.was_whole is (share == 1.0)
    for saved, source in ((found, "a"), (other, "b")):
        run, whole = read_run(saved.output), read_run(tmp_path / f"{source}.{suffix}")
        if share == 1.0 or source == "b":
            assert len(run) == len(whole)
        assert 20 < len(run) <= len(whole)
        np.testing.assert_array_equal(run["tension"], whole["tension"][: len(run)])
    with pytest.raises(UsageError, match="exists already"):
        recover(path)


def test_three_logs_of_which_one_has_no_sample(tmp_path: Path) -> None:
    path = _joined(tmp_path, "mcap", 1.0)
    empty = (tmp_path / "a.mcap").read_bytes()[:400]
    path.write_bytes(empty + path.read_bytes())
    found = recover(path)
    assert [Path(one.output).name for one in (found, *found.further)] == [
        "both.recovered.mcap",
        "both.recovered-2.mcap",
    ]


@pytest.mark.parametrize("wrong", [1, -1, 300, 1 << 40])
def test_a_chunk_with_a_wrong_length_is_damage_and_no_cut(
    tmp_path: Path, data: bytes, wrong: int
) -> None:
    path = tmp_path / "length.mcap"
    at = [n for n in range(len(data)) if data.startswith(b"\x04\0\0\0zstd", n)][3] - 37
    length = int.from_bytes(data[at + 1 : at + 9], "little") + wrong
    path.write_bytes(data[: at + 1] + length.to_bytes(8, "little") + data[at + 9 :])
    with pytest.raises(RunError, match=r"is damaged: .*winchkit log recover"):
        read_run(path)
    found = recover(path)
    assert found.dropped_pieces >= 1
    assert found.dropped_bytes == 0, "nothing is cut off"
    assert found.kept >= 250
