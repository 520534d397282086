"""Writes the table of ``docs/guide/contributions.md``: ``python -m docs.make.contributions``."""

from __future__ import annotations

from docs.make.pages import DOCS, put_between_marks, table
from fem_models.rig import preset
from validation.separation import loop_program, separate

PAGE = DOCS / "guide" / "contributions.md"
COMMAND = "docs.make.contributions"
PRESET, PRELOAD_N, AMPLITUDE_MM = "du2018", 20.0, 2.2


def text() -> str:
    """Divide the loop of the preset, and format its parts and its balance of energy."""
    found = separate(preset(PRESET, preload_N=PRELOAD_N), loop_program(-AMPLITUDE_MM, AMPLITUDE_MM))
    energy, width = found.parts("dissipated_mJ"), found.parts("width_deg")
    of_energy, of_width = found.shares("dissipated_mJ"), found.shares("width_deg")
    assert of_energy is not None
    assert of_width is not None
    rows = [
        [name.replace("_", " "), f"{of_energy[name]:.3f}", f"{energy[name]:.2f}", f"{of_width[name]:.3f}", f"{one:.3f}"]
        for name, one in width.items()
    ]
    rows.append(["sum", "1", f"{sum(energy.values()):.2f}", "1", f"{sum(width.values()):.3f}"])
    whole = found.whole
    balance = (
        f"The sum of the energies is compared with the losses that the engine records for every element: "
        f"{whole.friction_mJ:.2f} mJ\nof friction and {whole.material_mJ:.2f} mJ in the material, "
        f"{abs(found.closure_percent):.2f} % apart. A warning is given above 1 %."
    )
    head = ["part", "share of energy", "mJ a cycle", "share of width", "deg"]
    return f"{table(head, rows)}\n\n{balance}"


if __name__ == "__main__":
    put_between_marks(PAGE, COMMAND, text())
