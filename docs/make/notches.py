"""Writes ``docs/validation/notches.md``, ``notches.csv`` and their figure: ``python -m docs.make.notches``.

The page compares the analytic notch with the solid, and shows the convergence of the solid's mesh.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from docs.make.pages import DOCS, IMAGES, png, table, template
from fem_models.rig.joints import NOTCH_SHAPES
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from validation.joints import NotchResult
from validation.joints.checks.richardson import richardson
from validation.joints.notches import (
    ONE_SIDED_DEPTHS,
    PAIR_DEPTHS,
    TRUSTED_PERCENT,
    WALLS,
    WIDTHS,
    MeshRun,
    convergence,
    csv_text,
    grid,
    solve_all,
)

PAGE = DOCS / "validation" / "notches.md"
TABLE = PAGE.with_suffix(".csv")
PICTURE = IMAGES / "notches.png"
MIDDLE_WALL = WALLS[1]
_NAMES = {"v_pair": "V pair", "rectangular_pair": "slot pair", "rectangular": "one-sided slot"}
_MODELS = {"beam": "beam", "roots": "beam with roots"}
_LEVELS = (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)
_STYLES = ("dotted", "solid", "dashed")


def page(results: Sequence[NotchResult], runs: Sequence[MeshRun]) -> str:
    """Markdown of the page."""
    main = [r for r in results if r.in_grid]
    depth_tables = []
    for shape in NOTCH_SHAPES:
        chosen = [r for r in main if r.case.shape == shape and r.case.wall == MIDDLE_WALL]
        depth_tables.append(f"### {_NAMES[shape]}, wall {MIDDLE_WALL:g} D\n\n{_depth_table(chosen)}")
    return template("notches").format(
        cases=len(results),
        summary=_summary(main),
        depth_tables="\n\n".join(depth_tables),
        variants=_variant_table(results),
        mesh=_mesh_table(runs),
    )


def _summary(main: Sequence[NotchResult]) -> str:
    rows = []
    for quantity, model in (("bending", "beam"), ("bending", "roots"), ("axial", "beam"), ("shear", "beam")):
        errors = np.abs([r.error_percent(quantity, model) for r in main])
        within = np.mean(errors < TRUSTED_PERCENT)
        quantiles = [f"{np.median(errors):.1f} %", f"{np.quantile(errors, 0.9):.0f} %", f"{errors.max():.0f} %"]
        rows.append([quantity, _MODELS[model], *quantiles, f"{100 * within:.0f} % of cases"])
    return table(["stiffness", "model", "median", "90 % below", "largest", "within 5 %"], rows)


def _depth_table(chosen: Sequence[NotchResult]) -> str:
    widths = sorted({r.case.width for r in chosen})
    rows = []
    for depth in sorted({r.case.depth for r in chosen}):
        of_depth = {r.case.width: r for r in chosen if r.case.depth == depth}
        rows.append([f"{depth:g}", *(_arrow(of_depth[w]) for w in widths)])
    return table(["depth", *(f"{w:g}" for w in widths)], rows)


def _arrow(result: NotchResult) -> str:
    beam, roots = (result.error_percent("bending", model) for model in ("beam", "roots"))
    return f"{round(beam)} → {round(roots)}"  # round() has no -0


def _variant_table(results: Iterable[NotchResult]) -> str:
    rows = [
        [_NAMES[r.case.shape], f"{r.case.spacing:g}", f"{r.case.fillet:g}", _arrow(r)] for r in results if not r.in_grid
    ]
    return (
        f"Wall {MIDDLE_WALL:g}, width {WIDTHS[2]:g}, depth {PAIR_DEPTHS[2]:g} (pairs) or {ONE_SIDED_DEPTHS[2]:g} "
        f"(one-sided); errors in bending as above.\n\n{table(['shape', 'spacing', 'fillet', 'error, %'], rows)}"
    )


def _mesh_table(runs: Sequence[MeshRun]) -> str:
    rows, notes = [], []
    for fillet in sorted({r.fillet_mm for r in runs}):
        own = sorted((r for r in runs if r.fillet_mm == fillet), key=lambda r: r.refinement)
        rows += [
            [
                *(f"{r.fillet_mm:g}", f"{r.refinement:g}", str(r.elements), f"{r.bending:.2f}", f"{r.strain:.4f}"),
                *(f"{r.seconds:.1f}", f"{r.megabytes:.0f}"),
            ]
            for r in own
        ]
        notes.append(_richardson_note(fillet, own[:-4:-1]))
    head = ["fillet, mm", "refinement", "elements", "bending", "strain", "s", "MB"]
    return table(head, rows) + "\n\n" + "\n".join(notes)


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
    from matplotlib.colors import BoundaryNorm
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(11, 6.6), layout="constrained")
    axes = drawing.subplots(2, 3, sharex=True)
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
            ax.set_title(f"{_NAMES[shape]}, {_MODELS[model]}", fontsize=10)
            if column == 0:
                ax.set_ylabel("depth / D")
            if row == 1:
                ax.set_xlabel("width / D")
                ax.set_xticks([0.1, 0.2, 0.4, 0.8, 1.6], ["0.1", "0.2", "0.4", "0.8", "1.6"])
                ax.minorticks_off()
    bar = drawing.colorbar(filled, ax=axes, shrink=0.8)
    bar.set_label(f"error of the bending stiffness, % (wall {MIDDLE_WALL:g} D); blue: {TRUSTED_PERCENT:g} %")
    walls = ", ".join(f"{style} {wall:g} D" for wall, style in zip(WALLS, _STYLES, strict=True))
    drawing.suptitle(f"Analytic notch against solid; blue: {TRUSTED_PERCENT:g} % with walls of {walls}", fontsize=11)
    return png(drawing, dpi=100)


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


def main() -> None:
    """Solve the grid and the meshes, and write page, table and figure."""
    results = solve_all(grid())
    write_files({TABLE: csv_text(results), PAGE: page(results, convergence()), PICTURE: figure(results)})


if __name__ == "__main__":
    main()
