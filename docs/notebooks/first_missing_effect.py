# %% [markdown]
# # A first missing effect
#
# A simulated winch whose physics has one effect more than its profile. The notebook compares the
# model with recorded runs, names the effect, adds it, and shows that the error falls to the noise.
# No hardware; half a minute of computation. Requires `pip install 'winchkit[plot,pandas]'`.
#
# The file is a Python script with cells (`# %%`): VS Code, PyCharm and Spyder open it as it is,
# JupyterLab with `jupytext`.

# %%
from pathlib import Path
from tempfile import mkdtemp

from winchkit import (
    add,
    compare,
    diagnose,
    find,
    read_profile,
    read_programme,
    read_simbench,
    simulate,
    write_addition,
)

# %% [markdown]
# ## Profile and runs
#
# The profile has drum, gearbox, cable and pulleys as the drawings have them. The last line of a
# cell is shown in full.

# %%
source = find("profiles", "bench-spiral")
profile = read_profile(source)
profile

# %% [markdown]
# A motion programme is recorded twice under two loads. The repeats show the noise of the
# instruments: only a residual above it indicates a missing effect.

# %%
bench = read_simbench(find("sim", "demo-thick-layers"))
programme = read_programme(find("sim", "programme-demo"))
runs = list(simulate(bench, {"A": profile}, programme, seed=3))
runs[0]

# %%
runs[0].plot()

# %% [markdown]
# ## Compare
#
# Predicted are cable length, tension and motor torque from the motor's angle and the load. The grey
# band is the noise.

# %%
comparison = compare(runs, profile)
comparison

# %%
comparison.plot(output="cable_length")

# %% [markdown]
# As a table, for pandas, Polars or xarray: one row per output, run and sample, in SI.

# %%
comparison.to_pandas().groupby("output").residual.std()

# %% [markdown]
# ## Diagnose
#
# The length error depends on the free length. Which effect is it?

# %%
answer = diagnose(runs, profile)
answer

# %%
answer.plot(output="cable_length")

# %% [markdown]
# Where runs do not distinguish two effects, both are named, and the runs that would distinguish
# them; here there is one. The report of the fit has the statistics: χ² with its degrees of freedom,
# values with their intervals and plausible ranges, correlations.

# %%
print(answer.fit_report())

# %% [markdown]
# ## Add
#
# The effect is fitted and written into a copy of the profile, with its origin.

# %%
effect = answer.diagnosis.steps[0].effects[0]
addition = add(effect, runs, profile)
addition

# %%
better_file = Path(mkdtemp()) / "better.toml"
write_addition(source, addition, [run.name for run in runs], better_file)
better = compare(runs, read_profile(better_file))
better

# %% [markdown]
# The bench's file has the true value, which was not available to the diagnosis.

# %%
hidden = bench.truth["A"].hidden[0]
before, after = (c.outputs["cable_length"] for c in (comparison, better))
print(f"hidden: {hidden.physics} {dict(hidden.numbers)}")
print(f"named:  {effect} {dict(addition.added[0].values)}")
print(
    f"error of the cable length: {before.rms * 1e3:.2f} mm before, {after.rms * 1e3:.2f} mm after"
)
print(f"noise: {after.noise_rms * 1e3:.2f} mm")

# %%
assert effect == "layer-thickness"
assert after.rms < 1.1 * after.noise_rms < before.rms / 5
