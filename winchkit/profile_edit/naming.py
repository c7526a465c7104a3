"""File name that is proposed for a profile after a change of its effects."""

from __future__ import annotations

from pathlib import Path

from winchkit.arguments import path_of


def extended_name(profile: str | Path, *effects: str) -> str:
    """Proposed file name of a profile with added effects, such as ``bench-drum-radius.toml``.

    Command line, reports and the page propose this name, so that the commands of one continue
    from a file of the other.

    Parameters
    ----------
    profile : str or Path
        The profile that was extended, a name or a file; its folder is left out.
    *effects : str
        Ids of the added effects in their order, of a robot's line ``EFFECT/LINE``.

    Returns
    -------
    str
        Name without a folder.
    """
    path = path_of(profile, "profile")
    stem = path.stem if path.suffix == ".toml" else path.name
    return "-".join([stem, *(effect.replace("/", "-") for effect in effects)]) + ".toml"
