"""Figures of a family's answers: counts with exact 95 % intervals, and lists of failures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from campaign.family.places import VARIABLES, is_certain, places
from campaign.logger_score import clopper_pearson

Line = Mapping[str, Any]
FAILED = ("crash", "timeout")


def judge(line: Line) -> dict[str, Any]:
    """What an answer is worth against the truth of its case."""
    truth, steps = line["truth"], line["steps"]
    wanted = {tuple(place) for place in truth["places"]}
    told = [places(step) for step in steps]
    flat = {(part, output) for step in told for part, output, _ in step}
    friction = line["kind"] == "friction"
    fit = {
        (part, output)
        for step in told
        for part, output, variable in step
        if not friction or variable in VARIABLES
    }
    allowed = set(truth["right"]) | set(truth["also"])
    wrong_names, wrong_places = [], []
    for step, at in zip(steps, told, strict=True):
        if not is_certain(step):
            continue
        elsewhere = not {(part, output) for part, output, _ in at} & wanted
        beside = not set(step["effects"]) & set(truth["also"])
        if elsewhere and beside:
            wrong_places.append(step["effects"][0])
        if not set(step["effects"]) & allowed:
            wrong_names.append(step["effects"][0])
    return {
        "place": wanted <= flat,
        "right": wanted <= fit,
        "wrong_place": wrong_places,
        "wrong": wrong_names,
        "named": bool(set(truth["right"]) & {e for step in steps for e in step["effects"]}),
        "failed": line["verdict"] in FAILED,
    }


def _count(lines: Sequence[Line], test: Callable[[Line], bool]) -> str:
    hits, total = sum(map(test, lines)), len(lines)
    if not total:
        return "none"
    low, high = clopper_pearson(hits, total)
    return f"{hits} of {total} ({100 * low:.1f} to {100 * high:.1f} %)"


def table(lines: Sequence[Line]) -> str:
    """The rows of a kind, for a reader."""
    if not lines:
        return "no cases"
    rows = _ROWS[lines[0]["kind"]](lines)
    rows += [
        ("verdicts", _tally(line["verdict"] for line in lines)),
        ("crash", _count(lines, lambda x: x["verdict"] == "crash")),
        ("timeout", _count(lines, lambda x: x["verdict"] == "timeout")),
        ("seconds, median and worst", _seconds(lines)),
    ]
    width = max(len(name) for name, _ in rows) + 2
    return "\n".join(f"{name:{width}}{value}" for name, value in rows)


def _tally(values: Iterable[str]) -> str:
    counts: dict[str, int] = {}
    for value in values:
        counts[value] = counts.get(value, 0) + 1
    return ", ".join(f"{key} {n}" for key, n in sorted(counts.items(), key=lambda x: -x[1]))


def _seconds(lines: Sequence[Line]) -> str:
    every = sorted(line["seconds"] for line in lines)
    return f"{every[len(every) // 2]:.1f}, {every[-1]:.1f}"


def _friction(lines: Sequence[Line]) -> list[tuple[str, str]]:
    def seen(line: Line) -> bool:
        return bool(judge(line)["right"])

    rows = [
        ("place and variable right", _count(lines, seen)),
        ("certain and wrong (law or place)", _count(lines, lambda x: bool(judge(x)["wrong"]))),
        ("certain at a wrong place", _count(lines, lambda x: bool(judge(x)["wrong_place"]))),
        ("a right law among the names", _count(lines, lambda x: bool(judge(x)["named"]))),
        ("explained", _count(lines, lambda x: x["verdict"] == "explained")),
    ]
    for key in ("law", "part", "repeats"):
        groups: dict[str, list[Line]] = {}
        for line in lines:
            groups.setdefault(str(line["truth"]["detail"][key]), []).append(line)
        for name, group in sorted(groups.items()):
            said = f"{sum(map(seen, group))} of {len(group)} right"
            said += f", certain and wrong {sum(bool(judge(x)['wrong']) for x in group)}"
            rows.append((f"  {key} {name}", f"{said}; {_tally(x['verdict'] for x in group)}"))
    return rows


def _garbage(lines: Sequence[Line]) -> list[tuple[str, str]]:
    def of(line: Line) -> str:
        return str(line["truth"]["detail"]["garbage"])

    strange = [x for x in lines if of(x) not in {"constant", "grounded"}]
    constant = [x for x in lines if of(x) == "constant"]
    grounded = [x for x in lines if of(x) == "grounded"]
    rows = [
        ("ADEQUATE or EXPLAINED", _count(strange, lambda x: x["verdict"] in GOOD)),
        ("certain names", _count(strange, lambda x: any(map(is_certain, x["steps"])))),
        ("constants ADEQUATE", _count(constant, lambda x: x["verdict"] == "adequate")),
        ("constants EXPLAINED", _count(constant, lambda x: x["verdict"] == "explained")),
        ("grounded: the part is found", _count(grounded, _ground_found)),
        ("grounded: the rest is right", _count(grounded, _rest_right)),
    ]
    for name in dict.fromkeys(map(of, lines)):
        rows.append((f"  {name}", _tally(x["verdict"] for x in lines if of(x) == name)))
    return rows


GOOD = ("adequate", "explained")


def _ground_found(line: Line) -> bool:
    words = " ".join((*line["sanity"], *map(str, line["caveats"])))
    return any(word in words for word in ("ground", "slack", "supported", "set-down"))


def _rest_right(line: Line) -> bool:
    said = judge(line)
    if not line["truth"]["detail"]["hidden"]:
        return line["verdict"] == "adequate" and not line["steps"]
    return line["verdict"] == "explained" and said["right"] and not said["wrong"]


def _profiles(lines: Sequence[Line]) -> list[tuple[str, str]]:
    rows = [
        ("ADEQUATE", _count(lines, lambda x: x["verdict"] == "adequate")),
        ("the wrong number is a step", _count(lines, lambda x: bool(judge(x)["named"]))),
        ("its part and output are told", _count(lines, lambda x: bool(judge(x)["place"]))),
        ("certain and wrong", _count(lines, lambda x: bool(judge(x)["wrong"]))),
    ]
    groups: dict[str, list[str]] = {}
    for line in lines:
        groups.setdefault(line["truth"]["detail"]["wrong"], []).append(line["verdict"])
    return rows + [(f"  {name}", _tally(group)) for name, group in sorted(groups.items())]


_ROWS: dict[str, Callable[[Sequence[Line]], list[tuple[str, str]]]] = {
    "friction": _friction,
    "garbage": _garbage,
    "profiles": _profiles,
}


def _friction_fails(line: Line) -> bool:
    said = judge(line)
    return not said["right"] or bool(said["wrong"])


def _garbage_fails(line: Line) -> bool:
    kind = line["truth"]["detail"]["garbage"]
    if kind == "grounded":
        return not (_ground_found(line) and _rest_right(line))
    if kind == "constant":
        return bool(line["verdict"] == "adequate")
    return line["verdict"] in GOOD or any(map(is_certain, line["steps"]))


def _profile_fails(line: Line) -> bool:
    return line["verdict"] == "adequate" or bool(judge(line)["wrong"])


_FAILS: dict[str, Callable[[Line], bool]] = {
    "friction": _friction_fails,
    "garbage": _garbage_fails,
    "profiles": _profile_fails,
}


def fails(line: Line) -> bool:
    """Whether an answer is not as the aims want it."""
    return line["verdict"] in FAILED or _FAILS[line["kind"]](line)


def failures(lines: Sequence[Line]) -> list[str]:
    """Cases that are not as the aims want them, a line each, with the errors over the noise."""
    out = []
    for line in lines:
        if not fails(line):
            continue
        errors = " ".join(
            f"{name} {o['before'] / o['noise']:.3g} -> {o['after'] / o['noise']:.3g}"
            for name, o in line["outputs"].items()
            if o["noise"] and o["before"] is not None and o["after"] is not None
        )
        wrong = ", ".join(judge(line)["wrong"])
        told = f"{_told(line)}{f', certain and wrong {wrong}' if wrong else ''}"
        out.append(f"{line['seed']} {line['truth']['words']}: {told}; {errors} {_first(line)}")
    return out


def _first(line: Line) -> str:
    return str(line["text"].partition("\n")[0][:160])


def changes(old: Sequence[Line], new: Sequence[Line]) -> list[str]:
    """Cases of both whose verdict or names differ, a line each."""
    before = {line["seed"]: line for line in old}
    out = []
    for line in new:
        then = before.get(line["seed"])
        if then is not None and _told(then) != _told(line):
            out.append(f"{line['seed']} {line['truth']['words']}: {_told(then)} -> {_told(line)}")
    return out


def _told(line: Line) -> str:
    names = ["|".join(step["effects"]) for step in line["steps"]]
    return f"{line['verdict']} [{', '.join(names)}]"
