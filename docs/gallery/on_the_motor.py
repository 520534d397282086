"""Run the compensator where the motor is.

A reference is followed without compensation and with it. The drives come from a C file that knows the loop, with ten
lines of firmware around it.
"""

# %% [markdown]
# ## The motion that identifies the rig
# The shortest motion that fixes what the compensator needs, within limits of strain and tension. On a bench, the motor
# runs this program; here the chain model of the rig does, and a sensor adds its noise.

# %%
import numpy as np

import notchbend as nb

rig = nb.preset("du2018", preload_N=20.0)
motion = nb.calibrate(rig, amplitude_mm=2.2, noise_deg=0.05)
print(motion)
run = nb.simulate(rig, motion.load_program, engine="chain")
noise_deg = np.random.default_rng(4).normal(0.0, 0.05, run.angle_deg.size)
bench = nb.Record(run.drive, run.angle_deg + noise_deg, time_s=run.time_s, title="bench")

# %% [markdown]
# ## The C file
# One header and one source in C99, without allocation. Of the record alone it would be
# `nb.export(bench, "firmware", to="c")`.

# %%
fit = nb.identify(bench, settings=nb.IdentifySettings(elements=2), use_rig=False)
files = nb.export(fit, "firmware", to="c")
print(*(file.name for file in files))

# %% [markdown]
# ## Ten lines of firmware
# What a motor does at every tick: read the wanted angle, ask for the drive, go there. Here the wanted angles come from
# the standard input, and the drives go to the standard output.

# %%
import subprocess
from pathlib import Path

FIRMWARE = r"""
#include <stdio.h>
#include "compensator.h"
int main(void)
{
    compensator_state state;
    double wanted_deg;
    compensator_init(&state); /* the tube is where the record began */
    while (scanf("%lf", &wanted_deg) == 1)
        printf("%.9g\n", compensator_step(&state, wanted_deg));
    return 0;
}
"""
Path("firmware/motor.c").write_text(FIRMWARE)
build = ["cc", "-std=c99", "-O2", "motor.c", "compensator.c", "-o", "motor", "-lm"]
subprocess.run(build, cwd="firmware", check=True)

# %% [markdown]
# ## Followed without and with
# Without: the drive is read from the best curve that has no hysteresis.

# %%
from matplotlib.figure import Figure

wanted_deg = 30.0 * np.sin(np.linspace(0.0, 12.0, 240)) * np.linspace(1.0, 0.4, 240)
said = subprocess.run(
    ["firmware/motor"], input="\n".join(map(str, wanted_deg)), capture_output=True, text=True, check=True
)
drive_mm = np.array(said.stdout.split(), dtype=float)
along_mm = np.linspace(-2.2, 2.2, 441)
plain_mm = np.interp(wanted_deg, fit.plain(along_mm), along_mm)
figure = Figure(figsize=(7, 4.6), layout="constrained")
upper, lower = figure.subplots(2, 1, sharex=True)
upper.plot(wanted_deg, color="black", lw=0.8, label="wanted")
for name, path in (("without", plain_mm), ("with the C file", drive_mm)):
    angle_deg = nb.simulate(rig, nb.LoadProgram(np.append(0.0, path)), engine="chain").angle_deg[1:]
    error_deg = angle_deg - wanted_deg
    print(f"{name}: error {np.sqrt(np.mean(error_deg**2)):.3f} deg, at most {np.abs(error_deg).max():.3f} deg")
    upper.plot(angle_deg, label=name)
    lower.plot(error_deg, color=upper.lines[-1].get_color())
upper.set(ylabel="angle, deg")
lower.set(xlabel="tick", ylabel="angle - wanted, deg")
upper.legend(ncols=3, fontsize=8)
