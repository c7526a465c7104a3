"""Click type of options and arguments that are quantities: ``'75 mm'``, checked when it is read."""

from __future__ import annotations

import click


class QuantityType(click.ParamType):  # type: ignore[type-arg]
    """A number with a unit; it stays the text that was typed, which messages repeat."""

    def __init__(self, *dimensions: str, example: str, signed: bool = False) -> None:
        self.dimensions = dimensions
        self.example = example
        self.signed = signed
        self.name = " or ".join(dimensions)

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        """``LENGTH`` in usage lines."""
        return "|".join(self.dimensions).upper()

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        """The text; raises UsageError with option, value, accepted units and an example."""
        from winchkit.cli.core.quantities import check_typed

        text = str(value)
        unsigned = text.strip().lstrip("+-") if self.signed else text
        check_typed(naming(param), unsigned, *self.dimensions, example=self.example)
        return text


def naming(param: click.Parameter | None) -> str:
    """An option by its long spelling, an argument by its metavariable."""
    if param is None:
        return "value"
    if isinstance(param, click.Option):
        return max(param.opts, key=len)
    return param.metavar or (param.name or "").upper()
