"""The page and the figure of :mod:`validation.joints.notches`: the error of the analytic notch, and of the solid's mesh."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence

import numpy as np

from fem_models.rig.joints import NOTCH_SHAPES
from hysteresis.arrays import Floats
from validation.joints.notches import (
    ONE_SIDED_DEPTHS,
    PAIR_DEPTHS,
    TRUSTED_PERCENT,
    WALLS,
    WIDTHS,
    MeshRun,
    NotchResult,
)
from validation.joints.richardson import richardson

MIDDLE_WALL = WALLS[1]
_NAMES = {"v_pair": "V pair", "rectangular_pair": "slot pair", "rectangular": "one-sided slot"}
_LEVELS = (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)
_STYLES = ("dotted", "solid", "dashed")


def page(results: Sequence[NotchResult], runs: Sequence[MeshRun]) -> str:
    """Markdown of docs/validation/notches.md: what was compared, tables of the errors, mesh convergence."""
    main = [r for r in results if r.in_grid]
    parts = [_INTRODUCTION.format(cases=len(results), summary=_summary(main))]
    for shape in NOTCH_SHAPES:
        chosen = [r for r in main if r.case.shape == shape and r.case.wall == MIDDLE_WALL]
        parts.append(f"### {_NAMES[shape]}, wall {MIDDLE_WALL:g} D\n\n{_depth_table(chosen)}")
    parts.append(f"## Spacing and fillet\n\n{_variant_table(results)}")
    parts.append(_MESH.format(table=_mesh_table(runs)))
    return "\n\n".join(parts) + "\n"


_INTRODUCTION = """# Analytic notch against solid

Written by `python -m validation.joints.notches` from {cases} notches solved both ways; every case is in
[notches.csv](notches.csv). Lengths are shares of the outer diameter D, nu = 0.33, sharp corners, spacing 0.2 D.
*Beam* is the flexure of [the analytic model](../theory/analytic-model.md) in series with the tube of one ring; *solid*
is one pitch in curved quadratic tetrahedra, in bending and tension as part of an endless chain (the middles of the
rings stay plane), in shear between rigid plates.

{summary}

The beam is too stiff everywhere, because rings are not rigid where an arc is rooted in them. In the unrolled wall that
is a strip of the arc's length h on a plate, and plane stress gives the length by which it seems longer at each root:
h f(H/h), H being half the spacing, f from 0 to 0.415 (`fem_models/joint/roots.py`). No constant is fitted to the solid.
A rule follows: the beam alone is within 5 % where the flexure is longer than 40 such root lengths.

What is left with roots: fillets (below), the taper of a V, and one-sided notches that leave less than two walls of the
tube, where the radial section of the analytic model is not the metal's.

![Error of the bending stiffness over depth and width](../images/notches.png)

Bending stiffness, error of the beam in percent, and after the arrow with roots; columns are widths of the notch."""

_MESH = """## Mesh

The preset `du2018`, bending stiffness in the chain, Nmm/rad, and peak principal strain at the nodes per radian; every
mesh in a process of its own; s is processor time with imports, mesh, assembly and factorisation. The fillet is the
radius of a wire of 0.25 mm: smooth metal, for which quadratic elements have order 4 in the stiffness. At a sharp corner
the strain has no limit and the order falls to 1.09 (Williams, J. Appl. Mech. 19, 1952). Richardson's value, observed
order and grid convergence index (GCI) after Celik et al. 2008, doi 10.1115/1.2960953 (ASME V&V 20), from the three
finest meshes.

{table}"""


def _summary(main: Sequence[NotchResult]) -> str:
    rows = ["| stiffness | model | median | 90 % below | largest | within 5 % |", "|---|---|---|---|---|---|"]
    for quantity, model in (("bending", "beam"), ("bending", "roots"), ("axial", "beam"), ("shear", "beam")):
        errors = np.abs([r.error_percent(quantity, model) for r in main])
        within = np.mean(errors < TRUSTED_PERCENT)
        name = "beam" if model == "beam" else "beam with roots"
        rows.append(
            f"| {quantity} | {name} | {np.median(errors):.1f} % | {np.quantile(errors, 0.9):.0f} % "
            f"| {errors.max():.0f} % | {100 * within:.0f} % of cases |"
        )
    return "\n".join(rows)


def _depth_table(chosen: Sequence[NotchResult]) -> str:
    widths = sorted({r.case.width for r in chosen})
    rows = ["| depth | " + " | ".join(f"{w:g}" for w in widths) + " |", "|---" * (len(widths) + 1) + "|"]
    for depth in sorted({r.case.depth for r in chosen}):
        of_depth = {r.case.width: r for r in chosen if r.case.depth == depth}
        rows.append(f"| {depth:g} | " + " | ".join(_arrow(of_depth[w]) for w in widths) + " |")
    return "\n".join(rows)


def _arrow(result: NotchResult) -> str:
    beam, roots = (result.error_percent("bending", model) for model in ("beam", "roots"))
    return f"{round(beam)} → {round(roots)}"  # round() has no -0


def _variant_table(results: Iterable[NotchResult]) -> str:
    rows = [
        f"Wall {MIDDLE_WALL:g}, width {WIDTHS[2]:g}, depth {PAIR_DEPTHS[2]:g} (pairs) or {ONE_SIDED_DEPTHS[2]:g} "
        "(one-sided); errors in bending as above.\n",
        "| shape | spacing | fillet | error, % |",
        "|---|---|---|---|",
    ]
    for r in results:
        if not r.in_grid:
            rows.append(f"| {_NAMES[r.case.shape]} | {r.case.spacing:g} | {r.case.fillet:g} | {_arrow(r)} |")
    return "\n".join(rows)


def _mesh_table(runs: Sequence[MeshRun]) -> str:
    rows = ["| fillet, mm | refinement | elements | bending | strain | s | MB |", "|---" * 7 + "|"]
    notes = []
    for fillet in sorted({r.fillet_mm for r in runs}):
        own = sorted((r for r in runs if r.fillet_mm == fillet), key=lambda r: r.refinement)
        rows += [
            f"| {r.fillet_mm:g} | {r.refinement:g} | {r.elements} | {r.bending:.2f} | {r.strain:.4f} "
            f"| {r.seconds:.1f} | {r.megabytes:.0f} |"
            for r in own
        ]
        notes.append(_richardson_note(fillet, own[:-4:-1]))
    return "\n".join(rows) + "\n\n" + "\n".join(notes)


def _richardson_note(fillet: float, finest: Sequence[MeshRun]) -> str:
    one, two, three = finest
    sizes = (one.elements ** (-1 / 3), two.elements ** (-1 / 3), three.elements ** (-1 / 3))
    try:
        found = richardson(sizes, (one.bending, two.bending, three.bending))
    except ValueError as error:
        return f"- fillet {fillet:g} mm: no order, {error}"
    return (
        f"- fillet {fillet:g} mm: Richardson's value {found.value:.2f} Nmm/rad, observed order {found.order:.2f}, GCI "
        f"of the finest mesh {found.gci_percent:.2f} %"
    )


def figure(results: Sequence[NotchResult]) -> bytes:
    """PNG of the error in bending over depth and width for the three shapes, with the region within 5 % marked."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import BoundaryNorm
    from matplotlib.figure import Figure

    canvas = FigureCanvasAgg(Figure(figsize=(11, 6.6), layout="constrained"))
    axes = canvas.figure.subplots(2, 3, sharex=True)
    colours = BoundaryNorm(_LEVELS, 256)
    for column, shape in enumerate(NOTCH_SHAPES):
        for row, model in enumerate(("beam", "roots")):
            ax = axes[row, column]
            for wall, style in zip(WALLS, _STYLES, strict=True):
                widths, depths, error = _map(results, shape, wall, model)
                if wall == MIDDLE_WALL:
                    filled = ax.contourf(widths, depths, error, _LEVELS, norm=colours, cmap="YlOrRd", extend="both")
                if error.min() < TRUSTED_PERCENT < error.max():
                    ax.contour(widths, depths, error, [TRUSTED_PERCENT], colors="#1f5fa8", linestyles=style)
            ax.set_xscale("log")
            ax.set_title(f"{_NAMES[shape]}, " + ("beam" if model == "beam" else "beam with roots"), fontsize=10)
            if column == 0:
                ax.set_ylabel("depth / D")
            if row == 1:
                ax.set_xlabel("width / D")
                ax.set_xticks([0.1, 0.2, 0.4, 0.8, 1.6], ["0.1", "0.2", "0.4", "0.8", "1.6"])
                ax.minorticks_off()
    bar = canvas.figure.colorbar(filled, ax=axes, shrink=0.8)
    bar.set_label(f"error of the bending stiffness, % (wall {MIDDLE_WALL:g} D); blue: {TRUSTED_PERCENT:g} %")
    walls = ", ".join(f"{style} {wall:g} D" for wall, style in zip(WALLS, _STYLES, strict=True))
    canvas.figure.suptitle(
        f"Analytic notch against solid; blue: {TRUSTED_PERCENT:g} % with walls of {walls}", fontsize=11
    )
    stream = io.BytesIO()
    canvas.print_png(stream)
    return stream.getvalue()


def _map(results: Sequence[NotchResult], shape: str, wall: float, model: str) -> tuple[Floats, Floats, Floats]:
    """Widths, depths and the magnitude of the error (depths, widths), interpolated between the cases in log error."""
    from scipy.interpolate import RegularGridInterpolator

    chosen = {
        (r.case.depth, r.case.width): r for r in results if r.in_grid and (r.case.shape, r.case.wall) == (shape, wall)
    }
    depths, widths = (np.array(sorted({key[i] for key in chosen})) for i in (0, 1))
    error = np.array([[chosen[d, w].error_percent("bending", model) for w in widths] for d in depths])
    surface = RegularGridInterpolator((depths, np.log(widths)), error)
    fine_d, fine_w = np.linspace(depths[0], depths[-1], 81), np.geomspace(widths[0], widths[-1], 81)
    fine_w = np.clip(fine_w, widths[0], widths[-1])
    return fine_w, fine_d, np.abs(surface(tuple(np.meshgrid(fine_d, np.log(fine_w), indexing="ij"))))
