"""Names and values that callers give: types of arguments, and declarations by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit import catalog
from winchkit.arguments import require_each, require_type, require_types
from winchkit.errors import UsageError
from winchkit.runs.run import Run


def test_a_value_of_the_type_or_of_a_derived_one_passes() -> None:
    require_type(True, int, "count")
    require_type(Path("a"), (str, Path), "path")
    require_types([], Run, "runs")
    require_types(("a", "b"), str, "names")
    require_each({"A": [1], "B": ()}, int, "winches")


def test_a_message_has_argument_value_and_remedy() -> None:
    with pytest.raises(UsageError) as error:
        require_types(["a.csv"], Run, "runs")
    assert str(error.value) == "runs[0] is a str 'a.csv'; pass a Run: read_run(path)"
    with pytest.raises(UsageError, match=r"^winches\['B'\]\[0\] is None; pass a Run"):
        require_each({"A": [], "B": [None]}, Run, "winches")


def test_text_is_no_list_of_texts() -> None:
    with pytest.raises(UsageError, match=r"^names is a str 'ab'; pass a list of str$"):
        require_types("ab", str, "names")


def test_a_long_value_is_cut_and_has_no_control_characters() -> None:
    with pytest.raises(UsageError) as error:
        require_type("\x1b[31m" + "x" * 100, int, "count")
    assert "\\x1b" in str(error.value)
    assert len(str(error.value)) < 90


def test_a_file_in_the_folder_is_found_before_a_shipped_one(tmp_path: Path) -> None:
    bench, own = tmp_path / "bench.toml", tmp_path / "generic-cia402.toml"
    bench.touch()
    own.touch()
    assert catalog.find("devices", "generic-cia402", bench) == own


def test_a_file_that_has_the_name_of_its_own_device_means_the_shipped_one(tmp_path: Path) -> None:
    bench = tmp_path / "generic-cia402.toml"
    bench.touch()
    shipped = catalog.folder("devices") / "generic-cia402" / "device.toml"
    assert catalog.find("devices", "generic-cia402", bench) == shipped
    assert catalog.find("devices", "generic-cia402", str(bench)) == shipped
