"""What is missing in my rig?

The model of a rig does not follow its records. The trace adds each effect of the catalogue to the model, fits it with
all parameters, and names the one that predicts best what no fit has seen.
"""

# %% [markdown]
# ## Two records of a rig with a secret
# The rig has unequal tendons: tendon b has a smaller moment arm. The records do not mention it. They have noise of
# 0.05 deg.

# %%
from dataclasses import replace

import numpy as np

import notchbend as nb

noise = np.random.default_rng(3)
records = []
for preload_N, amplitude_mm in ((20.0, 2.2), (10.0, 1.6)):
    rig = nb.preset("du2018", preload_N=preload_N)
    secret = replace(rig, tendon_b=replace(rig.tendon_b, moment_arm_mm=0.94 * rig.tendon_b.moment_arm_mm))
    run = nb.simulate(secret, nb.triangle(amplitude_mm, cycles=2), engine="chain")
    angle = run.angle_deg + noise.normal(0.0, 0.05, run.angle_deg.size)
    known = {"preset": "du2018", "preload_N": preload_N}
    records.append(nb.Record(run.drive, angle, cycle=run.cycle, title=f"{preload_N:g} N", rig=known))
figure = nb.plot(records)

# %% [markdown]
# ## Trace
# The verdict is `effect` where one effect explains the residual, `ambiguous` where the records do not distinguish
# several, and `none` where nothing is missing. [Trace](../guide/trace.md) has the others.

# %%
trace = nb.trace(records)
print(trace.verdict, [added.effect.name for added in trace.effects])
print(f"before {trace.baseline.heldout_rmse_deg:.3f} deg, after {trace.augmented.heldout_rmse_deg:.3f} deg")
figure = nb.plot(trace)
