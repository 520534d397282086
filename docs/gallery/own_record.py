"""My own record.

A record is a CSV file with the drive and the angle, and beside it a TOML file that says what is known of the rig.
Here a simulated loop with noise stands for the bench.
"""

# %% [markdown]
# ## The files
# The first lines stand for your measurement: three cycles of 2.2 mm at 20 N, the angle with 0.05 deg of noise.

# %%
from pathlib import Path

import numpy as np

import notchbend as nb

run = nb.simulate(nb.preset("du2018", preload_N=20.0), nb.triangle(2.2, cycles=3), engine="chain")
noise = np.random.default_rng(1).normal(0.0, 0.05, run.angle_deg.size)
table = np.column_stack([run.drive, run.angle_deg + noise])
np.savetxt("bench-20N.csv", table, fmt="%.4f", delimiter=",", header="wheel,camera", comments="")

Path("bench-20N.toml").write_text("""\
schema = 1
title = "Bench, 20 N"

[columns]
drive = "wheel"
angle = "camera"

[rig]
preset = "du2018"
preload_N = 20.0
""")
record = nb.read_record("bench-20N.csv")
print(record)
figure = nb.plot(record)

# %% [markdown]
# ## Identify
# The angle is f(drive) + h: f follows from the rig, and h is a law of hysteresis that is fitted. Cycles that the fit
# has not seen choose the law. The errors, too, are those of samples that no fit has used. If the error with the law
# is close to the noise, as here, it explains the loop. If not, [what is missing in my rig](whats_missing.md) goes on.

# %%
fit = nb.identify(record)
print(f"law             {fit.law_title}")
print(f"held-out error  {fit.heldout.rmse_deg:.3f} deg, without hysteresis {fit.baseline_heldout.rmse_deg:.3f} deg")
print(f"noise           {fit.noise_floor_deg:.3f} deg")
figure = nb.plot(fit)
