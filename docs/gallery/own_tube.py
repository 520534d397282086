"""My own tube.

A rig file describes the tube, the notches, the material, the wheel and the tendons. The numbers here are those of no
real tube: put yours in their place.
"""

# %% [markdown]
# ## The rig

# %%
from pathlib import Path

import notchbend as nb

mine = Path("mine.toml")
mine.write_text("""\
preload_N = 15.0

[tube]
outer_diameter_mm = 6.0
inner_diameter_mm = 5.4

[notch]
shape = "rectangular_pair"
count = 10
depth_mm = 2.6
width_mm = 0.8
spacing_mm = 1.2

[material]
youngs_modulus_GPa = 60.0
poissons_ratio = 0.33

[wheel]
radius_mm = 8.0

[friction]
sheath_N = 0.5

[tendon]
EA_N = 9000.0
toe_N = 20.0
moment_arm_mm = 2.5
free_length_mm = 120.0
""")
rig = nb.read_rig(mine)
print(rig)
figure = nb.plot(rig)

# %% [markdown]
# ## Its loop at two preloads
# `replace` gives the same rig with another number. The chain takes milliseconds; `engine="multibody"` computes the
# same rig with Exudyn. The loop is a thin line beside the angle, so the figure has a second chart: the angle less its
# backbone, the middle between the rising and the falling branch. At 30 N the tendons are beyond their toe region and
# stretch less, and the loop is narrower.

# %%
from dataclasses import replace

program = nb.triangle(1.5, cycles=2)
records = []
for preload_N in (15.0, 30.0):
    record = nb.simulate(replace(rig, preload_N=preload_N), program, engine="chain")
    records.append(replace(record, title=f"{preload_N:g} N"))
    print(f"{preload_N:g} N: {record.angle_deg.min():.1f} to {record.angle_deg.max():.1f} deg")
figure = nb.plot(records)

# %% [markdown]
# ## Where the loop comes from
# Each source is switched on and off in the model. This material has no loop, so friction alone loses energy. Half of
# the width belongs to the tendons all the same: friction makes a loop of the angle because they stretch.

# %%
parts = nb.separate(rig, amplitude_mm=1.5)
print(parts)
figure = nb.plot(parts)
