"""Where fitted values came from, as a profile file notes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from winchkit.diagnosis.result import Estimate, OutputFit
    from winchkit.effects.bind import Term
    from winchkit.effects.profile_file import Fitted
    from winchkit.effects.profile_ledger import Judged

__all__ = ["provenance"]


def provenance(
    terms: Sequence[tuple[Term, Mapping[str, Estimate]]],
    outputs: Mapping[str, OutputFit],
    runs: Sequence[str],
) -> tuple[list[Fitted], Judged]:
    """Fitted terms and the ledger's figures, dated today."""
    from datetime import UTC, datetime

    from winchkit.effects.profile_file import Fitted
    from winchkit.effects.profile_ledger import Judged

    today = datetime.now(UTC).date()
    fitted = [Fitted(t, {n: e.std for n, e in v.items()}, runs, today) for t, v in terms]
    judged = Judged(
        today,
        runs,
        {name: o.unit for name, o in outputs.items()},
        {name: o.heldout_rms_before for name, o in outputs.items()},
        {name: o.heldout_rms_after for name, o in outputs.items()},
        {name: o.noise_rms for name, o in outputs.items() if o.noise_rms is not None},
    )
    return fitted, judged
