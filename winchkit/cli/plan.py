"""``winchkit plan``: the next motion programme, as a file that ``winchkit run`` executes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.output import echo_json
from winchkit.cli.runs_option import catalogue_of, model_options, read_runs

if TYPE_CHECKING:
    from winchkit.diagnosis.plan import Offer
    from winchkit.effects.bind import Term

__all__ = ["command"]


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@click.option("-o", "--output", metavar="NEXT.toml", help="Programme to write.")
@model_options
def command(
    runs: Sequence[str],
    output: str | None,
    profile: str,
    effect_files: Sequence[str],
    winch: str | None,
    band: float | None,
    as_json: bool,
) -> None:
    """Propose what to run next, by what it tells apart and shows per minute.

    Kinds of programmes are tried on the model with the noise of the RUNs: those that separate
    the effects that these runs cannot tell apart come first, else those that show what these
    could not. Run the file with 'winchkit run NEXT.toml --bench B' and diagnose again.
    """
    from winchkit.catalog import find
    from winchkit.diagnosis.confusion import pairs_of
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.diagnosis.plan import offers, programme_of
    from winchkit.schema.programme_file import write_programme
    from winchkit.schema.read import read_winch

    declared, catalogue = read_winch(find("profiles", profile)), catalogue_of(effect_files)
    answer = diagnose(read_runs(runs, winch), declared, catalogue, band)
    problem, pairs = answer.inquiry.problem, pairs_of(answer.sets)
    found = offers(problem, pairs, answer.found.noise.rms, list(catalogue))
    if output:
        path = Path(output)
        write_programme(programme_of(problem.dataset, found[0].kind, path.stem), path)
        click.echo(f"written: {output}", err=True)
    if as_json:
        listed = [offer.to_json(pairs) for offer in found]
        echo_json({"schema": 1, "offers": listed, "programme": output})
    else:
        click.echo(_text(found, pairs))


def _text(found: Sequence[Offer], pairs: Sequence[tuple[Term, Term]]) -> str:
    """A line a kind, the best first."""
    from winchkit.diagnosis.report.columns import aligned
    from winchkit.diagnosis.report.wording import percent

    head = ["programme", "minutes"]
    head += [f"{a.effect.id} / {b.effect.id}" for a, b in pairs]
    rows = [[*head, "shows besides"]]
    for offer in found:
        powers = [percent(power) for power in offer.powers]
        shown = ", ".join(offer.shows) or "—"
        rows.append([offer.kind.name, f"{offer.minutes:.1f}", *powers, shown])
    told = "power to tell apart" if pairs else "nothing to tell apart: what it would show besides"
    return "\n".join([f"what to run next ({told})", *aligned(rows, words=1)])
