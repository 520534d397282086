"""Choose preload and notch.

A study simulates every combination of some numbers. Which preload and which depth of the notches give a narrow loop
and still stay within the strain that the material bears?
"""

# %% [markdown]
# ## The study
# A study file names the rig, the program, what varies and what is computed. A study runs in processes of its own,
# which import the script that started them: that is why its call stands below `if __name__ == "__main__"`.

# %%
from pathlib import Path

import notchbend as nb

Path("design.toml").write_text("""\
schema = 1
title = "Preload and depth"
engine = "chain"

[rig]
preset = "du2018"

[program]
amplitude_mm = 2.2
cycles = 2

[vary]
preload_N = [10, 15, 20, 30, 40]
notch.depth_mm = { from = 2.60, to = 2.90, count = 5 }

[quantities]
groups = ["loop", "strain"]
""")
if __name__ == "__main__":
    study = nb.study("design.toml", "design", workers=1)
    figure = nb.plot(study)

# %% [markdown]
# ## The choice
# `superelastic_margin` is the allowed strain over the largest one, with 6 % allowed. Of the designs that stay below
# half of it and bend far enough, the one with the narrowest loop is taken. [Studies](../guide/studies.md) has the
# other margins: fatigue asks for far less strain.

# %%
if __name__ == "__main__":
    cases = study.to_dataframe()
    feasible = cases[(cases.superelastic_margin >= 2) & (cases.full_scale_angle_deg >= 44)]
    print(f"{len(feasible)} of {len(cases)} designs bend to 44 deg within half of the superelastic strain")
    best = feasible.loc[feasible.loop_width_max_deg.idxmin()]
    print(f"{best.preload_N:g} N, depth {best['notch.depth_mm']:.3f} mm: loop {best.loop_width_max_deg:.2f} deg")
