"""Compensate the loop.

A rig that should bend to 20 deg bends to less on the way up and to more on the way down. The inverse of a fit gives
the drive that makes the angle follow.
"""

# %% [markdown]
# ## Identify, and invert
# The fit needs a record with loops of several sizes, because the wanted path has small loops, too.

# %%
from itertools import pairwise

import numpy as np

import notchbend as nb

rig = nb.preset("du2018", preload_N=20.0)
turns_mm = [0.0, 2.2, -2.2, 1.6, -1.6, 1.0, -1.0, 0.0]
path_mm = np.concatenate([np.arange(a, b, 0.1 if b > a else -0.1) for a, b in pairwise(turns_mm)])
record = nb.simulate(rig, nb.LoadProgram(path_mm), engine="chain")
figure = nb.plot(record)

# %%
wanted_deg = 30.0 * np.sin(np.linspace(0.0, 12.0, 240)) * np.linspace(1.0, 0.4, 240)
fit = nb.identify(record, settings=nb.IdentifySettings(elements=2), use_rig=False)
drive = nb.compensate(fit, wanted_deg)
print(drive)
print(*drive.summary.warnings, sep="\n")
figure = nb.plot(drive)

# %% [markdown]
# ## Drive the rig with it
# Without compensation, the drive is read from the best curve without hysteresis.

# %%
from matplotlib.figure import Figure

along = np.linspace(-2.2, 2.2, 441)
plain = np.interp(wanted_deg, fit.plain(along), along)
figure = Figure(figsize=(7, 3), layout="constrained")
axes = figure.subplots()
for name, path in (("without", plain), ("with compensation", drive.drive)):
    angle_deg = nb.simulate(rig, nb.LoadProgram(np.append(0.0, path)), engine="chain").angle_deg[1:]
    error_deg = angle_deg - wanted_deg
    print(f"{name}: error {np.sqrt(np.mean(error_deg**2)):.3f} deg, at most {np.abs(error_deg).max():.3f} deg")
    axes.plot(error_deg, label=name)
axes.set(xlabel="sample", ylabel="angle - wanted, deg")
axes.legend()
