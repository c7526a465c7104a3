"""``winchkit diagnose`` and ``compare`` with ``--winch all``: every winch of a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from winchkit.cli.core.messages import is_verbose, note
from winchkit.cli.core.outcome import threads_abandoned
from winchkit.cli.core.output import echo_each, echo_json, is_json
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.diagnose import answer_figures, answer_page, said
from winchkit.cli.model.options import (
    Asked,
    page_title,
    pages_beside,
    save_figures,
    save_page,
    suggest_with,
    write_page,
)

if TYPE_CHECKING:
    from winchkit.diagnosis.results import Diagnosis
    from winchkit.schema.profiles.winch import WinchProfile


def tell_diagnoses(
    runs: Sequence[str],
    declared: WinchProfile,
    asked: Asked,
    how: Mapping[str, bool],
    html: str | None,
    figures: str | None,
) -> None:
    """Diagnosis of every winch of the runs by itself, and their common effects."""
    from winchkit.diagnosis.linear_axis import in_units_of
    from winchkit.effects.linear_axis import catalogue_of
    from winchkit.fleet.diagnosis.diagnose import diagnose_each
    from winchkit.fleet.diagnosis.meta_analysis import alarms, shared_effects
    from winchkit.fleet.report.comparison import shared_effects_text

    told: dict[str, Any] = {}
    found: dict[str, Diagnosis] = {}
    present: dict[str, float] = {}
    title, catalogue = page_title(declared.name, runs), asked.catalogue
    with threads_abandoned(), progress_bar() as progress:
        winches = asked.runs_of_each(runs)
        pages = pages_beside(html, list(winches)) if html else {}
        each = diagnose_each(winches, declared, catalogue, asked.band, **how, progress=progress)
        for name, answer in each:
            # Without the traces, which are megabytes each.
            found[name] = replace(answer.diagnosis, traces=())
            told[name] = said(answer)
            present[name] = answer.result.lack_of_fit_test.p_value
            if html:
                own = answer_page(answer, f"{title}, {name}", replace(asked, winch=name))
                save_page(str(Path(html).with_name(pages[name])), own)
            if figures:
                save_figures(figures, answer_figures(answer, asked), name)
            del answer  # hundreds of megabytes after long runs
    shared = shared_effects(found, catalogue_of(declared, catalogue))
    chances = alarms(found, present)
    if is_json():
        together = {"effects": [one.to_json() for one in shared], "alarms": chances}
        echo_json({"schema": 1, "winches": told, "shared": together})
    else:
        overview = in_units_of(declared, shared_effects_text(found, shared, chances))
        echo_each(told, overview, in_units_of(declared, "winch"))
    if html:
        from winchkit.fleet.report.comparison import shared_effects_html

        page = shared_effects_html(found, shared, chances, title, pages)
        write_page(html, in_units_of(declared, page))
    if figures:
        note(f"figures: {figures}")


def tell_comparisons(
    runs: Sequence[str],
    declared: WinchProfile,
    asked: Asked,
    html: str | None,
    figures: str | None,
) -> None:
    """Every winch of the runs by itself, and what their errors follow alike or not."""
    from winchkit.diagnosis.compare import compared
    from winchkit.diagnosis.linear_axis import in_units_of
    from winchkit.fleet.diagnosis.anova import errors_of, shared_errors
    from winchkit.fleet.report.comparison import shared_errors_text
    from winchkit.report.pages.pages import comparison_figures, comparison_html
    from winchkit.report.reproducibility import CommandLine
    from winchkit.report.text import compare_text

    found, errors = {}, {}
    title, catalogue = page_title(declared.name, runs), asked.catalogue
    with progress_bar() as progress:
        winches = asked.runs_of_each(runs)
        pages = pages_beside(html, list(winches)) if html else {}
        for index, (name, own) in enumerate(winches.items()):
            progress(name, index / len(winches))
            answer = compared(own, declared, catalogue, asked.band)
            found[name], errors[name] = answer.comparison, errors_of(answer)
            if html:
                options = replace(asked, winch=name).options
                page = comparison_html(answer, f"{title}, {name}", asked.profile, options=options)
                save_page(str(Path(html).with_name(pages[name])), page)
            if figures:
                source = CommandLine(answer.regression.dataset, asked.profile).source
                save_figures(figures, comparison_figures(answer, source), name)
            del answer  # gigabytes after long runs
    shared = shared_errors(errors)
    if is_json():
        said = {name: one.to_json() for name, one in found.items()}
        outputs = {name: one.to_json() for name, one in shared.items()}
        echo_json({"schema": 1, "winches": said, "shared": {"outputs": outputs}})
    else:
        texts = {name: compare_text(one, verbose=is_verbose()) for name, one in found.items()}
        overview = in_units_of(declared, shared_errors_text(found, shared))
        echo_each(texts, overview, in_units_of(declared, "winch"))
    if html:
        from winchkit.fleet.report.comparison import shared_errors_html

        page = shared_errors_html(found, shared, title, pages)
        write_page(html, in_units_of(declared, page))
    if figures:
        note(f"figures: {figures}")
    suggest_with("diagnose", asked, runs)
