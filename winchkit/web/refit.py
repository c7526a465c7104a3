"""An addition to the profile of the page: refitted, and shown before it is diagnosed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from winchkit.diagnosis.add import fitted_addition_to
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.results import OutputFit
from winchkit.diagnosis.write import write_addition
from winchkit.effects.catalogue import Catalogue
from winchkit.errors import UsageError
from winchkit.quantity_text import quantity
from winchkit.report.words.vocabulary import effect_name, output_name
from winchkit.web.curves import curves_of
from winchkit.web.ladder import ModelErrors
from winchkit.web.state import PageState, Version


def refit(
    state: PageState, effect: str, dataset: Dataset, catalogue: Catalogue, folder: Path
) -> PageState:
    """State with an effect in the profile, refitted but not yet diagnosed; raises UsageError."""
    answer = state.answer
    if answer is None:
        raise UsageError("nothing is diagnosed yet")
    if effect not in catalogue:
        raise UsageError(f"there is no effect '{effect}'")
    fitted = fitted_addition_to(effect, dataset, catalogue)
    path = folder / f"version-{len(state.versions)}.toml"
    names = [item.name for item in state.used]
    write_addition(state.versions[-1].path, fitted.addition, names, path, replace=True)
    outputs = fitted.addition.outputs
    before = {name: out.heldout_rms_before for name, out in outputs.items()}
    label = (
        "Profile as loaded"
        if len(state.versions) == 1
        else f"+ {effect_name(state.versions[-1].added)}"
    )
    now = {
        name: replace(out, heldout_rms_before=out.heldout_rms_after)
        for name, out in outputs.items()
    }
    shown = replace(answer.diagnosis, outputs=now, steps=(), candidates=(), where=())
    noise = {name: out.noise_rms for name, out in outputs.items()}
    return replace(
        state,
        versions=(*state.versions, Version(path, effect)),
        rungs=(*state.rungs, ModelErrors(label, before)),
        said=_said(outputs),
        answer=WinchAnswer(answer.engine, answer.result, shown),
        refitted=True,
        curves=curves_of(fitted.regression, fitted.final.residual, noise),
        before=(answer, state.curves),
        faults=(),
    )


def _said(outputs: Mapping[str, OutputFit]) -> str:
    """Error of the output whose error fell most, after and before."""

    def fall(name: str) -> float:
        return outputs[name].heldout_rms_before / max(outputs[name].heldout_rms_after, 1e-300)

    name = max(outputs, key=fall)
    out = outputs[name]
    after, before = (quantity(v, out.unit) for v in (out.heldout_rms_after, out.heldout_rms_before))
    return f"{output_name(name).capitalize()} error {after}, was {before}"
