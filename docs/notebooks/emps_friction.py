# %% [markdown]
# # EMPS: from the raw file to a named friction
#
# EMPS is a motor with a ball screw that moves a carriage; its recordings are a public benchmark
# (A. Janot, M. Gautier, M. Brunot, *Data Set and Reference Models of EMPS*, Workshop on Nonlinear
# System Identification Benchmarks, 2019). They have no licence and are no part of winchkit: set
# `WINCHKIT_EMPS` to the folder with `DATA_EMPS.mat`, the authors' file, or with `train.csv`, the
# same recording as a run of winchkit. Requires `pip install 'winchkit[plot,pandas,parquet]'`.

# %%
import os
from pathlib import Path

import pandas as pd
from scipy.io import loadmat

from winchkit import add, compare, diagnose, read_profile, read_run, run_of, write_addition

folder = Path(os.environ["WINCHKIT_EMPS"])

# %% [markdown]
# ## The raw file
#
# The authors' file has the time `t`, the position `qm` in m, and the voltage `vir` of the
# amplifier; `gtau` is its force per volt. A table with units becomes a run of a linear axis, with a
# position and a force.

# %%
if (folder / "DATA_EMPS.mat").is_file():
    raw = {
        name: value.ravel()
        for name, value in loadmat(folder / "DATA_EMPS.mat").items()
        if name[0] != "_"
    }
    table = pd.DataFrame(
        {"time": raw["t"], "position": raw["qm"], "force": raw["vir"] * raw["gtau"]}
    )
else:
    # There the same numbers are called an angle and a torque.
    own = read_run(folder / "train.csv")
    table = pd.DataFrame(
        {"time": own.time, "position": own["motor_angle"], "force": own["motor_torque"]}
    )
run = run_of(table, units={"time": "s", "position": "m", "force": "N"}, name="emps")
run

# %%
run.plot()

# %% [markdown]
# ## The model
#
# The starting model has the mass and the viscous friction that the authors publish.

# %%
work = Path("emps")
work.mkdir(exist_ok=True)
source = work / "emps.toml"
source.write_text(
    """\
schema = 1
kind = "axis"
motion = "linear"
name = "emps"

[[effect]]
id = "rotor-inertia"
mass = "95.11 kg"

[[effect]]
id = "motor-viscous"
viscosity = "203.5 N s/m"
"""
)
profile = read_profile(source)
profile

# %%
comparison = compare([run], profile)
comparison

# %%
comparison.plot()

# %% [markdown]
# The residual is a square wave with the sign of the speed: Coulomb friction. Without repeats the
# noise is unknown, and the result says so.
#
# ## The diagnosis

# %%
answer = diagnose([run], profile)
answer

# %%
answer.plot()

# %% [markdown]
# ## The friction, with its size
#
# Coulomb friction alone, to compare it with the value of the authors, 20.4 N.

# %%
addition = add("motor-coulomb", [run], profile)
addition

# %%
better = work / "better.toml"
write_addition(source, addition, [run.name], better)
after = compare([run], read_profile(better))
after

# %%
friction = addition.added[1]["force"]
print(f"Coulomb friction {friction.value:.1f} ± {friction.std:.1f} N; published: 20.4 N")

# %%
named = {effect for step in answer.diagnosis.steps for effect in step.effects}
assert named & {"motor-coulomb", "motor-stribeck"}
assert abs(friction.value / 20.4 - 1) < 0.15
assert after.outputs["force"].rms < 0.6 * comparison.outputs["force"].rms
