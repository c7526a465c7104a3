"""A quantity with a wrong unit: every option of every command names itself, with an example."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from command_line import commands, done
from winchkit.cli.core.quantity_type import QuantityType, naming
from winchkit.errors import UsageError
from winchkit.units import parse

WRONG = "3 furlongs"
WORDS = r"LENGTH|ANGLE|TIME|SPEED|ACCELERATION|FORCE|TENSION|MASS|STIFFNESS|TORQUE|CONSTANT|RATE"
PLAIN = [
    (words, parameter)
    for words, command in commands()
    for parameter in command.params
    if isinstance(parameter.type, QuantityType)
]
COMPOUND = {
    "calibrate --noise": "position=3 furlongs",
    "move --pose": "x=3 furlongs",
    "move --pose-by": "yaw=3 furlongs",
    "fleet trend --limit": "cell-gain.gain_error=3 furlongs",
    "import --sensitivity": WRONG,
    "import --column": "motor_angle=Pos [furlongs]",
    "log --rotate": WRONG,
}
"""Options whose value has more than a quantity."""


def is_quantity(parameter: click.Parameter) -> bool:
    """Whether an option or argument is a quantity by its metavariable or its default."""
    if re.fullmatch(rf"({WORDS})(\|({WORDS}))*", str(parameter.metavar)):
        return True
    if not isinstance(parameter.default, str):
        return False
    number, _, unit = parameter.default.partition(" ")
    return bool(unit) and number.replace(".", "").isdigit()


def test_every_quantity_of_the_command_tree_has_the_type() -> None:
    named = [
        (words, naming(parameter))
        for words, command in commands()
        for parameter in command.params
        if is_quantity(parameter)
    ]
    assert named
    assert set(named) <= {(words, naming(parameter)) for words, parameter in PLAIN}
    assert len(PLAIN) > 30


@pytest.mark.parametrize(("words", "parameter"), PLAIN, ids=[f"{w} {naming(p)}" for w, p in PLAIN])
def test_a_wrong_unit_names_the_option(words: str, parameter: click.Parameter) -> None:
    name = naming(parameter)
    values = [WRONG] * parameter.nargs
    given = [name, *values] if isinstance(parameter, click.Option) else ["A", *values]
    result = done(*words.split(), *given, code=2)
    assert name in result.stderr
    assert f"'{WRONG}'" in result.stderr
    assert isinstance(parameter.type, QuantityType)
    assert f"'{parameter.type.example}'" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("option", COMPOUND)
def test_a_wrong_unit_within_a_value_names_the_option(
    option: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text("time [s],Pos [deg]\n0,0\n1,1\n", encoding="utf-8")
    (tmp_path / "bench.toml").write_text('schema = 1\nkind = "bench"\n', encoding="utf-8")
    words, _, name = option.partition(" --")
    if option.startswith("fleet"):
        words, name = "fleet trend", "limit"
    more = {
        "calibrate": ["cabtive", "a.csv", "-o", "new.toml"],
        "fleet trend": [".", "-p", "bench-spiral"],
        "import": ["a.csv", "-o", "runs"],
        "log": ["-o", "log.csv", "-b", "bench.toml"],
        "move": ["-b", "bench.toml"],
    }[words]
    result = done(*words.split(), *more, f"--{name}", COMPOUND[option], code=2)
    assert f"--{name}" in result.stderr
    assert "furlongs" in result.stderr


@pytest.mark.parametrize(
    "parameter", [p for _, p in PLAIN], ids=[f"{w} {naming(p)}" for w, p in PLAIN]
)
def test_examples_and_defaults_are_accepted(parameter: click.Parameter) -> None:
    kind = parameter.type
    assert isinstance(kind, QuantityType)
    for text in (kind.example, parameter.default):
        if isinstance(text, str):
            assert kind.convert(text, parameter, None) == text
            assert any(_is(text, dimension) for dimension in kind.dimensions)


def _is(text: str, dimension: str) -> bool:
    try:
        parse(text, dimension)
    except UsageError:
        return False
    return True


def test_a_bound_is_given_with_its_option() -> None:
    result = done("move", "--to", "1e9m", code=2)
    assert "--to: '1e9m' must be at most 100000 m" in result.stderr
    result = done("log", "--for", "-3s", code=2)
    assert "--for: '-3s' is below zero" in result.stderr
