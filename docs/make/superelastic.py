"""Writes ``docs/validation/superelastic.md`` and its figures: ``python -m docs.make.superelastic``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from docs.make.pages import DOCS, IMAGES, png, table, template
from fem_models.rig.rig import notched_tube
from fem_models.solid.superelastic import HARDENING_SHARE
from hysteresis.files import write_files
from validation.joints.checks.superelastic import (
    LAW,
    REFINEMENT,
    CaseResult,
    MeshRun,
    cases,
    draw,
    largest_errors,
    solve_all,
    trusted_deg,
)

PAGE = DOCS / "validation" / "superelastic.md"
PICTURE = IMAGES / "superelastic.png"
_LAWS = ("rigid roots", "engines", "fit")
_SHOWN = (0, 1, 2, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21)
_LOADING_STEPS = 12


def page(results: Sequence[CaseResult], runs: Sequence[MeshRun]) -> str:
    """Markdown of the page."""
    return template("superelastic").format(
        upper=LAW.plateau_MPa,
        lower=LAW.unloading_plateau_MPa,
        span=100 * LAW.transformation_strain,
        share=100 * HARDENING_SHARE,
        summary=_summary(results),
        cases="\n\n".join(_case(result) for result in results),
        chosen=REFINEMENT,
        mesh=_mesh_table(runs),
    )


def _summary(results: Sequence[CaseResult]) -> str:
    rows = [
        [
            *(r.case.name, f"{r.case.thrust_N:g}"),
            *(f"{error:.0f} %" for error in largest_errors(r)),
            *(f"{trusted_deg(r):.1f}", f"{100 * np.abs(r.laws[1] - r.without_thrust).max() / r.laws[1].max():.0f} %"),
            str(r.elements),
        ]
        for r in results
    ]
    return table(
        ["notch", "thrust, N", *_LAWS, "engines in 10 %, deg", "effect of thrust", "elements of the fit"], rows
    )


def _case(result: CaseResult) -> str:
    notch, curve = notched_tube(result.case.rig).cut, result.curve
    rows = []
    for i in _SHOWN:
        moment = curve.moment_Nmm[i]
        rows.append(
            [
                f"{np.degrees(curve.angle_rad[i]):.1f}{'' if i < _LOADING_STEPS else ' ↓'}",
                f"{moment:.3f}",
                *(f"{round(100 * (law[i] / moment - 1))}" for law in result.laws),
                f"{100 * curve.principal_strain[i]:.2f}",
                f"{100 * result.strain_fibre[i]:.1f}",
                f"{100 * curve.transformed[i]:.1f}",
                f"{curve.neutral_offset_mm[i]:.3f}",
            ]
        )
    head = ["deg", "solid", *_LAWS, "strain, %", "fibre, %", "martensite, %", "neutral, mm"]
    prose = (
        f"Width {notch.width_mm:g}, spacing {notch.spacing_mm:g}, depth {notch.depth_mm:g}, fillet "
        f"{result.case.fillet_mm:g} mm.\nMoment of the solid in Nmm; difference of the laws in percent of it; largest "
        "principal (logarithmic) strain of the\nsolid, and strain of the outermost fibre y theta/L; share of "
        "martensite in the metal between the rings; distance of the\n"
        "neutral axis from the tube axis. Arrows mark unloading."
    )
    return f"## {result.case.name}\n\n{prose}\n\n{table(head, rows)}"


def _mesh_table(runs: Sequence[MeshRun]) -> str:
    rows = [
        [
            *(run.name, f"{run.refinement:g}", f"{run.hardening:g}", str(run.elements)),
            *(f"{run.moment_Nmm:.4f}", f"{run.strain:.4f}", f"{run.seconds:.0f}"),
        ]
        for run in sorted(runs, key=lambda r: (r.name, r.hardening, r.refinement))
    ]
    return table(["notch", "refinement", "plateau's slope / E", "elements", "moment, Nmm", "strain", "s"], rows)


def figure(results: Sequence[CaseResult]) -> bytes:
    """PNG of the moment over the angle of every case: solid and laws."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(20, 4.4), layout="constrained")
    for ax, result in zip(drawing.subplots(1, len(results)), results, strict=True):
        degrees = np.append(0.0, np.degrees(result.curve.angle_rad))
        for law, name, style in zip(result.laws, _LAWS, (":", "--", "-"), strict=True):
            ax.plot(degrees[:25], np.append(0.0, law)[:25], style, lw=1.2, label=name)
        ax.plot(degrees, np.append(0.0, result.curve.moment_Nmm), "k-o", ms=3, lw=1.4, label="solid")
        ax.set_title(result.case.name, fontsize=10)
        ax.set_xlabel("angle of one joint, deg")
    drawing.axes[0].set_ylabel("moment, Nmm")
    drawing.axes[0].legend(fontsize=8, loc="upper left")
    return png(drawing, dpi=100)


def main() -> None:
    """Solve all cases, and write page and figures."""
    results, runs = solve_all()
    write_files({PAGE: page(results, runs), PICTURE: figure(results)})
    draw(cases()[1], 15.0, PICTURE.with_name("superelastic-strain.png"))


if __name__ == "__main__":
    main()
