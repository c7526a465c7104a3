"""Registration of the renderers of result types; imported when the first result is shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from winchkit import wings
from winchkit.diagnosis.add import Addition, Removal
from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.plan import WinchPlan
from winchkit.diagnosis.results import Comparison, Diagnosis
from winchkit.fit_statistics import FitStatistics
from winchkit.rendering import Renderer, renderers
from winchkit.report.notebook import figures, html, text
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

_DIAGNOSIS: tuple[Callable[..., Any], ...] = (
    text.diagnosis_screen,
    html.diagnosis_cell,
    figures.result_figure,
)


def _of_diagnosis(render: Callable[..., Any]) -> Callable[..., Any]:
    """A renderer of a diagnosis for the answer that has it."""
    return lambda answer, **options: render(answer.diagnosis, **options)


for _kind, _renderer in (
    (Run, Renderer(text.run_screen, html.run_cell, figures.run_figure)),
    (WinchProfile, Renderer(text.profile_screen, html.profile_cell, figures.winch_figure)),
    (Comparison, Renderer(text.comparison_screen, html.comparison_cell, figures.result_figure)),
    (Diagnosis, Renderer(*_DIAGNOSIS)),
    (Answer, Renderer(*map(_of_diagnosis, _DIAGNOSIS))),
    (Addition, Renderer(text.addition_screen, html.addition_cell)),
    (Removal, Renderer(text.addition_screen, html.addition_cell)),
    (WinchPlan, Renderer(text.plan_screen, html.plan_cell)),
    (FitStatistics, Renderer(text.fit_screen, html.fit_cell)),
):
    renderers.register(_kind, _renderer)
for _wing in wings.own():
    for _module in _wing.renderers:
        renderers.load_from(_module)
