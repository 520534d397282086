"""The page and the figure of :mod:`validation.joints.superelastic`."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np

from fem_models.rig.rig import notched_tube
from fem_models.solid.superelastic import HARDENING_SHARE
from validation.joints.superelastic import LAW, REFINEMENT, CaseResult, MeshRun, largest_errors

_LAWS = ("rigid roots", "engines", "fit")
_SHOWN = (0, 1, 2, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21)


def page(results: Sequence[CaseResult], runs: Sequence[MeshRun]) -> str:
    """Markdown of docs/validation/superelastic.md."""
    parts = [
        _INTRODUCTION.format(
            upper=LAW.plateau_MPa,
            lower=LAW.unloading_plateau_MPa,
            span=100 * LAW.transformation_strain,
            share=100 * HARDENING_SHARE,
            summary=_summary(results),
        )
    ]
    parts += [_case(result) for result in results]
    parts.append(_MESH.format(chosen=REFINEMENT, table=_mesh_table(runs)))
    return "\n\n".join(parts) + "\n"


_INTRODUCTION = """# Superelastic notch as a solid

Written by `python -m validation.joints.superelastic`. One notch is bent as a solid with large rotation and a superelastic law
(`fem_models/solid/large_bending.py`) and compared with the section law of the engines (`fem_models/joint/superelastic.py`).

- Strain: (C - C^-1)/4 (Bazant 1998, doi 10.1115/1.2807001), the logarithmic strain to 0.7 % of it at 10 %: exact for
  any rotation, alike in tension and compression. Saint Venant and Kirchhoff's law is not: at 8 % Green's strain is
  8.3 % in tension and 7.7 % in compression.
- Law: one transformation strain along the deviator of stress (Auricchio, Taylor, Lubliner 1997,
  doi 10.1016/S0045-7825(96)01232-7), linear in either way, martensite as stiff as austenite, tension and compression
  alike. Plateaus {upper:g} and {lower:g} MPa, {span:g} % (order of a usual alloy, not fitted), E 50 GPa (wrists),
  60 GPa (du2018), nu 0.33. The plateau rises by {share:g} % of E.
- Boundary: as in an endless chain in pure bending, free of axial force. No tendon's compression, no closure.

Laws: *engines* is the section law of the chain and of the multibody model: fibres of the section over the width of
the notch, in series with the elastic roots of `fem_models/joint/roots.py`; *rigid roots* leaves the roots out; *fit* are
parallel flag elements by `flag_fit.fibres_of_curve`, fitted to the first loop. The path is up, down to zero, and up
again to half. Largest difference to the solid, of its largest moment:

{summary}

![Moment over angle](../images/superelastic.png)

What it means:

- Roots are elastic metal and hardly transform. Left out, a one-sided notch comes out more than half too stiff at small
  angles; in series, the engines' law is within 14 % on '90' up to 16 deg and on '150' up to 15 deg. Near closure it is
  19 and 54 % too stiff: the section's outer fibres are through, where a third of the solid's metal has transformed.
- What is left has two causes. The bent arc flattens, so that the moment falls along the plateau (5 % on '150'); no
  section that keeps its shape has that. The corners transform long before the fibre's strain says.
- V pairs: on the way up the engines' law is within 10 % to 8 deg a joint and up to 18 % too soft beyond, up to 20 % on
  the way back from there: its root metal stays elastic and the solid's strip is used up. The working range of `du2018`
  ends at 3.2 deg a joint.
- The strain of the outermost fibre is no guide to the peak at the fillets: the solid has up to 2.6 times y theta/L.
  Sharper corners have more.
- Where the moment matters to 5 %, elements of the same kind can be fitted to the solid's curve:
  `fibres_of_curve(moment_angle(rig, angles))`. Parallel elements cannot soften, which is the error of '150'. The
  engines do not take such elements from a rig file yet.
- On the way up a von Mises plasticity with the same plateau in CalculiX gives the moment of `du2018` within 0.5 %, the
  elastic law likewise (`tests/fem_models/solid/test_solid_superelastic.py`).

![Strain of one notch of '150' at 15 deg](../images/superelastic-strain.png)"""

_MESH = """## Mesh and hardening

Bent once to the largest angle; the tables above have refinement {chosen:g}. Elements are of the quarter that is solved;
s is the clock's, two runs at a time on a machine with other work. At refinement 0.4 the fillet of '150' has too few
elements: the strain there is of a distorted one.

{table}"""


def _summary(results: Sequence[CaseResult]) -> str:
    rows = ["| notch | " + " | ".join(_LAWS) + " | elements of the fit |", "|---" * (len(_LAWS) + 2) + "|"]
    for result in results:
        errors = " | ".join(f"{error:.0f} %" for error in largest_errors(result))
        rows.append(f"| {result.case.name} | {errors} | {result.elements} |")
    return "\n".join(rows)


def _case(result: CaseResult) -> str:
    notch = notched_tube(result.case.rig).notch
    rows = [
        f"## {result.case.name}\n",
        f"Width {notch.width_mm:g}, spacing {notch.spacing_mm:g}, depth {notch.depth_mm:g}, fillet "
        f"{result.case.fillet_mm:g} mm. Moment of the solid in Nmm, the laws' difference in percent of it; largest\n"
        "principal (logarithmic) strain of the solid, and of the outermost fibre y theta/L;\n"
        "martensite in the metal between the rings; neutral axis from the tube axis.\n",
        "| deg | solid | " + " | ".join(_LAWS) + " | strain, % | fibre, % | martensite, % | neutral, mm |",
        "|---" * (len(_LAWS) + 6) + "|",
    ]
    curve = result.curve
    for i in _SHOWN:
        moment = curve.moment_Nmm[i]
        laws = " | ".join(f"{round(100 * (law[i] / moment - 1))}" for law in result.laws)
        way = "" if i < 12 else " ↓"
        rows.append(
            f"| {np.degrees(curve.angle_rad[i]):.1f}{way} | {moment:.3f} | {laws} "
            f"| {100 * curve.principal_strain[i]:.2f} "
            f"| {100 * result.strain_fibre[i]:.1f} "
            f"| {100 * curve.transformed[i]:.1f} | {curve.neutral_offset_mm[i]:.3f} |"
        )
    return "\n".join(rows)


def _mesh_table(runs: Sequence[MeshRun]) -> str:
    rows = ["| notch | refinement | plateau's slope / E | elements | moment, Nmm | strain | s |", "|---" * 7 + "|"]
    for run in sorted(runs, key=lambda r: (r.name, r.hardening, r.refinement)):
        rows.append(
            f"| {run.name} | {run.refinement:g} | {run.hardening:g} | {run.elements} | {run.moment_Nmm:.4f} "
            f"| {run.strain:.4f} | {run.seconds:.0f} |"
        )
    return "\n".join(rows)


def figure(results: Sequence[CaseResult]) -> bytes:
    """PNG of the moment over the angle of every case: solid, laws, fit."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    canvas = FigureCanvasAgg(Figure(figsize=(13, 4.4), layout="constrained"))
    for ax, result in zip(canvas.figure.subplots(1, len(results)), results, strict=True):
        degrees = np.append(0.0, np.degrees(result.curve.angle_rad))
        for law, name, style in zip(result.laws, _LAWS, (":", "--", "-"), strict=True):
            ax.plot(degrees[:25], np.append(0.0, law)[:25], style, lw=1.2, label=name)
        ax.plot(degrees, np.append(0.0, result.curve.moment_Nmm), "k-o", ms=3, lw=1.4, label="solid")
        ax.set_title(result.case.name, fontsize=10)
        ax.set_xlabel("angle of one joint, deg")
    canvas.figure.axes[0].set_ylabel("moment, Nmm")
    canvas.figure.axes[0].legend(fontsize=8, loc="upper left")
    stream = io.BytesIO()
    canvas.print_png(stream)
    return stream.getvalue()
