"""Violations of metamorphic relations, counted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import Any

from campaign.family.places import is_certain
from campaign.family.relations import RELATIONS

Answer = Mapping[str, Any]
FAILED = ("crash", "timeout", "refused")
TOLD = ("adequate", "explained", "partly")
SILENT = ("unknown", "undecided")
LARGE = 5.0
"""Times the detectable size, from which on a name must stay with other noise and less data."""
INVERSE = ("stiffness", "axial_stiffness", "creep_stiffness", "k1")
"""Parameters of which less is more."""
SIGNED = ("offset", "torque", "phase")
"""Parameters that change their sign with the motor's, or their zero."""


def violations(base: Answer, other: Answer, relation: str) -> dict[str, Any]:
    """What another form of the same data changes in an answer."""
    if other["verdict"] in FAILED or base["verdict"] in FAILED:
        return {"failed": other["verdict"] in FAILED and base["verdict"] not in FAILED}
    of_size = RELATIONS[relation].of_size
    sure = {s["effects"][0] for s in base["steps"] if is_certain(s)}
    sure = {e for e in sure if not of_size or _times_detectable(base, e) >= LARGE}
    told = {e for step in base["steps"] for e in step["effects"]}
    names = {e for step in other["steps"] for e in step["effects"]}
    now_sure = {s["effects"][0] for s in other["steps"] if is_certain(s)}
    off, values = _outside(base, other, relation)
    lost, new = sure - names, sorted(now_sure - told)
    instead = bool(lost) or RELATIONS[relation].exact
    return {
        "failed": False,
        "lost": sorted(lost),
        "uncertain": sorted((sure & names) - now_sure),
        "another": new if instead else [],
        "new": [] if instead else new,
        "silent": base["verdict"] in TOLD and other["verdict"] in SILENT,
        "verdict": base["verdict"] != other["verdict"],
        "outside": off,
        "values": values,
    }


def _times_detectable(answer: Answer, effect: str) -> float:
    """Largest size of an effect's parameters over the detectable one; infinite where unknown."""
    out = []
    smallest = answer.get("detectable", {}).get(effect, {})
    for step in answer["steps"]:
        for name, value in step["values"].get(effect, {}).items():
            if not smallest.get(name) or not value["value"]:
                continue
            if name == "efficiency":
                out.append((1 - value["value"]) / (1 - smallest[name]))
                continue
            ratio = abs(value["value"] / smallest[name])
            out.append(1 / ratio if name in INVERSE else ratio)
    return max(out, default=float("inf"))


def _values(answer: Answer) -> dict[tuple[str, str], Mapping[str, Any]]:
    """Values with a standard deviation, of effects of one step only: an order has a step each."""
    steps = [effect for step in answer["steps"] for effect in step["values"]]
    return {
        (effect, name): value
        for step in answer["steps"]
        for effect, values in step["values"].items()
        for name, value in values.items()
        if steps.count(effect) == 1 and value.get("std") and value.get("value") is not None
    }


def _outside(base: Answer, other: Answer, relation: str) -> tuple[list[str], int]:
    """Values whose difference is outside its 95 % interval, and how many values there are.

    Of the same data that interval is that of one of them.
    """
    then, now = _values(base), _values(other)
    out, count = [], 0
    for key in then.keys() & now.keys():
        a, b = then[key], now[key]
        if relation == "sign and direction" and key[1] in SIGNED:
            continue
        count += 1
        spread = max(a["std"], b["std"])
        if not RELATIONS[relation].exact:
            spread = float((a["std"] ** 2 + b["std"] ** 2) ** 0.5)
        apart = a["value"] - b["value"]
        if key[1] == "phase":
            apart = (apart + pi) % (2 * pi) - pi
        if abs(apart) > 1.96 * spread:
            off = f"{' '.join(key)} {a['value']:.4g} ± {a['std']:.2g} -> {b['value']:.4g}"
            out.append(f"{off} ± {b['std']:.2g}")
    return sorted(out), count


def relation_table(lines: Sequence[Mapping[str, Any]]) -> str:
    """Counts of violations a relation, and each of them in a line.

    A certain name that is in no set any more is *lost*, in a set of several *uncertain*; *another*
    is certain instead, or with the same information, *new* beside it, which may be right.
    """
    heads = (
        "cases",
        "failed",
        "lost",
        "uncertain",
        "another",
        "silent",
        "new",
        "verdict",
        "outside",
    )
    rows = [f"{'':24}" + "".join(f"{h:>11}" for h in heads)]
    listed = []
    for name in [n for n in RELATIONS if n != next(iter(RELATIONS))]:
        found = [(x, violations(x, x["relations"][name], name)) for x in lines]
        cells = [str(len(found))]
        cells += [str(sum(bool(v.get(h)) for _, v in found)) for h in heads[1:-1]]
        cells.append(
            f"{sum(len(v.get('outside', ())) for _, v in found)}/"
            f"{sum(v.get('values', 0) for _, v in found)}"
        )
        rows.append(f"{name:24}" + "".join(f"{cell:>11}" for cell in cells))
        for line, v in found:
            bad = {k: w for k, w in v.items() if w and k not in {"values", "verdict", "new"}}
            if bad:
                there = line["relations"][name]
                said = f"{_told(line)} -> {_told(there)} {_first(there)}"
                listed.append(f"{line['seed']} {line['truth']['words']} | {name}: {said} {bad}")
    bases = [f"{x['seed']} {x['truth']['words']}: {_told(x)} {_first(x)}" for x in lines]
    return "\n".join([*rows, "", "base cases", *bases, "", "violations", *listed])


def _told(answer: Answer) -> str:
    names = ["|".join(step["effects"]) for step in answer["steps"]]
    return f"{answer['verdict']} [{', '.join(names)}]"


def _first(answer: Answer) -> str:
    return str(answer["text"].partition("\n")[0][:160])
