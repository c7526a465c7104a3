"""The simulated benches that are shipped: they read, they differ only in what they hide."""

from dataclasses import replace

import pytest

from winchkit.catalog import find, names
from winchkit.effects.catalogue import load_catalogue
from winchkit.schema.read import load, read_programme, read_simbench
from winchkit.schema.simbench import HiddenSpec, SimBench
from winchkit.sim.bench import (
    choose_bench,
    choose_hidden,
    demo_names,
    listed_benches,
    profiles_of,
    programme_path,
)
from winchkit.sim.physics.table import build, scaled
from winchkit.sim.plant.kinematics import Kinematics
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.schedule import schedule

BENCHES = [name for name in names("sim") if not name.startswith("programme-")]
ROBOTS = ("cabtive-robot", "hanging-robot", "winding-device-robot")
WIRED_OTHERWISE = ("spiral-bench", "grooved-bench", "serial-bench", *ROBOTS)
VARIANTS = [name for name in BENCHES if name not in WIRED_OTHERWISE]


@pytest.mark.parametrize("name", BENCHES)
def test_it_reads_and_runs(name: str) -> None:
    bench = read_simbench(find("sim", name))
    profiles = profiles_of(bench)
    for winch, truth in bench.truth.items():
        WinchPlant(profiles[winch], truth, seed=0, noise=bench.noise)


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_is_the_same_bench(name: str) -> None:
    base, variant = (read_simbench(find("sim", n)) for n in ("spiral-bench", name))
    assert variant.noise == base.noise
    assert replace(variant.bench, description="", path="") == replace(
        base.bench, description="", path=""
    )


@pytest.mark.parametrize("name", VARIANTS)
def test_answers_stand_in_the_catalogue(name: str) -> None:
    known = {effect.id for effect in load_catalogue()}
    for truth in read_simbench(find("sim", name)).truth.values():
        for spec in truth.hidden:
            assert set(spec.answers) <= known
            outside = "Outside the catalogue" in read_simbench(find("sim", name)).description
            assert outside == (not spec.answers)


def test_every_other_file_of_the_folder_is_a_programme() -> None:
    assert [row.name for row in listed_benches()] == BENCHES
    others = [name for name in names("sim") if name not in BENCHES]
    assert others == ["programme-demo", "programme-demo-fast", "programme-demo-slow"]
    assert load(find("sim", others[0])).kind == "programme"


def test_the_demonstration_is_short_and_fits_its_bench() -> None:
    bench = read_simbench(find("sim", "spiral-bench"))
    limits = {name: wiring.limits for name, wiring in bench.bench.winch.items()}
    length = {n: Kinematics.of(p).length_reference for n, p in profiles_of(bench).items()}
    motion = read_programme(programme_path("programme-demo"))
    plans = schedule(motion, limits, length, {"A": 10.0})
    assert [plan.load_mass["A"] for plan in plans] == [10.0, 20.0, 10.0, 20.0]
    assert sum(plan.duration for plan in plans) < 50.0


def test_seeds_in_a_row_show_every_choice() -> None:
    count = len(demo_names())
    assert count >= 13
    hidden = [choose_hidden(seed)["A"] for seed in range(count)]
    assert sum(not specs for specs in hidden) == 1
    assert len({specs[0].physics for specs in hidden if specs}) == count - 1


@pytest.mark.parametrize("seed", [0, 1, 17])
def test_a_seed_chooses_the_same_again(seed: int) -> None:
    assert choose_bench(seed) == choose_bench(seed)


def test_sizes_differ_by_seed_and_stay_near_the_declared() -> None:
    count = len(demo_names())

    def error(bench: SimBench) -> float:
        (piece,) = build(bench.truth["A"].hidden)
        return float(getattr(piece, piece.size))

    for first in range(count):
        one, two = choose_bench(first), choose_bench(first + count)
        if one.truth["A"].hidden:
            assert error(one) != error(two)
            assert 1 / 2 < error(one) / error(two) < 2


def test_scaling_goes_by_what_shows() -> None:
    (rope,) = build([scaled(HiddenSpec("elastic rope", {"axial_stiffness": "200 kN"}), 2.0)])
    assert rope.axial_stiffness == pytest.approx(100e3)
    (drum,) = build([scaled(HiddenSpec("fat drum", {"radius_error": "1 mm"}), 2.0)])
    assert drum.radius_error == pytest.approx(2e-3)
    unsized = HiddenSpec("lossy gear", {"efficiency": 0.9})
    assert scaled(unsized, 2.0) == unsized
