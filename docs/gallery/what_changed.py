"""What has changed since last week?

A rig that was measured before needs no model of its geometry: the old records are the reference, and only what
changed since is traced. Here the camera has a new driver, and its angles come 0.1 s late.
"""

# %% [markdown]
# ## Before and after
# Two tests in each week, a slow and a fast one. The drive decays, so that each test has loops of several sizes. The
# records know nothing of the rig but its preload.

# %%
import numpy as np

import notchbend as nb

noise = np.random.default_rng(5)
rig = nb.preset("du2018", preload_N=20.0)


def measured(rate_Hz: float, *, amplitude_mm: float, late_s: float, title: str) -> nb.Record:
    """Three cycles; every twelfth sample is recorded, late, with the noise of a camera."""
    turns = np.linspace(0.0, 3.0, 1441)
    path_mm = amplitude_mm * np.exp(-0.25 * turns) * np.sin(2 * np.pi * turns)
    run = nb.simulate(rig, nb.LoadProgram(path_mm), engine="chain")
    time_s = turns[::12] / rate_Hz
    seen_deg = np.interp(time_s - late_s, turns / rate_Hz, run.angle_deg) + noise.normal(0.0, 0.03, time_s.size)
    return nb.Record(run.drive[::12], seen_deg, time_s=time_s, title=title, rig={"preload_N": 20.0})


before = [measured(rate, amplitude_mm=2.2, late_s=0.0, title=f"before, {rate} Hz") for rate in (0.1, 0.4)]
after = [measured(rate, amplitude_mm=2.0, late_s=0.1, title=f"after, {rate} Hz") for rate in (0.1, 0.4)]
figure = nb.plot([before[1], after[1]])

# %% [markdown]
# ## Trace the change
# The verdict is `effect` if what is named brings the error down to that of the reference, and `partial` if it takes a
# large part of it. Here the delay takes nearly all. Play operators stand for the rig, and they follow it to a tenth
# of a degree, not to the noise.

# %%
trace = nb.trace(after, reference=before)
found = trace.to_dict()["effects"][0]
print(trace.verdict, found["name"], f"{found['parameters']['delay_s']['value']:.3f} s")
print(f"before {trace.baseline.heldout_rmse_deg:.2f} deg, after {trace.augmented.heldout_rmse_deg:.2f} deg")
figure = nb.plot(trace)
