"""Names that are proposed for extended profiles."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit.profile_edit.naming import extended_name


@pytest.mark.parametrize(
    ("profile", "effects", "name"),
    [
        ("bench-spiral", ["drum-radius"], "bench-spiral-drum-radius.toml"),
        ("there/own.toml", ["drum-radius"], "own-drum-radius.toml"),
        ("release-1.2", ["drum-radius"], "release-1.2-drum-radius.toml"),
        ("cabtive", ["swivel-radius/3"], "cabtive-swivel-radius-3.toml"),
        (Path("a/own.toml"), [], "own.toml"),
    ],
)
def test_the_name_has_the_profile_and_its_additions(
    profile: str | Path, effects: list[str], name: str
) -> None:
    assert extended_name(profile, *effects) == name


def test_one_addition_after_another_has_the_name_of_both_at_once() -> None:
    first = extended_name("bench-spiral", "drum-radius")
    assert extended_name(first, "cable-creep") == extended_name(
        "bench-spiral", "drum-radius", "cable-creep"
    )
