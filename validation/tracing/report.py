"""A trace as plain values for JSON, and in words for a reader."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

from hysteresis.metrics import Errors, errors
from hysteresis.uncertainty import Parameter
from validation.tracing.fitting import Fitted
from validation.tracing.next_experiment import Experiment
from validation.tracing.residual import dependences
from validation.tracing.search import samples_of
from validation.tracing.second_opinion import Confirmation
from validation.tracing.trace import Candidate, Trace

UNNAMED = ("none", "unexplained")
"""Verdicts that name no effect."""


def to_dict(
    trace: Trace,
    *,
    experiment: Experiment | None = None,
    confirmation: Confirmation | None = None,
    seconds: float | None = None,
    seed: int = 0,
) -> dict[str, Any]:
    """Plain values of a trace, as in trace.json; what is not finite becomes None.

    ``train`` and ``heldout`` are errors of the fitted samples and of those that no fit has seen, zeros of records taken
    out. ``delta_bic`` of a candidate is how much lower its criterion is than the declared model's; that of an effect,
    than that of the model before it was added. ``declared`` has the constants of the declared model as fitted
    together with the effects. ``seconds`` and ``seed`` are passed through.
    """
    found = fitted_parameters(trace.augmented, samples_of(trace.augmented))
    before = _pair(errors_of(trace.baseline))
    named = trace.verdict not in UNNAMED
    confirmed = confirmation is not None and confirmation.before is not None and confirmation.after is not None
    result: dict[str, Any] = {
        "schema": 1,
        "records": [record_name(record.source, i) for i, record in enumerate(trace.records)],
        "noise_floor_deg": trace.floor.deg,
        "before": before,
        "verdict": trace.verdict,
        "effects": _effects(trace, found[1:]) if named else [],
        "after": _pair(errors_of(trace.augmented)) if named else before,
        "multibody": None,
        "candidates": [_candidate(candidate) for candidate in ranked(trace.candidates)],
        "next_experiment": experiment.words if experiment else "",
        "rig_known": trace.known,
        "model": trace.model,
        "heldout_by": trace.baseline.holdout.by,
        "declared": {name: p.to_dict() for name, p in found[0].items()},
        "words": list(trace.words),
        "smooth": {"names": list(trace.smooth.names), "rmse_deg": math.sqrt(trace.smooth.square)},
        "residual": {
            "before": _dependences(trace, trace.baseline),
            "after": _dependences(trace, trace.augmented) if named else None,
        },
        "samples": {"all": int(trace.baseline.row.size), "independent": samples_of(trace.augmented)},
        "multibody_words": confirmation.words if confirmation else "not run",
        "alike": trace.alike,
        "seconds": seconds,
        "seed": seed,
    }
    if confirmed and confirmation is not None and confirmation.before and confirmation.after:
        result["multibody"] = {"before": confirmation.before.to_dict(), "after": confirmation.after.to_dict()}
    return dict(_finite(result))


def record_name(source: str, index: int) -> str:
    """Name of a record: its file, or its place among the records."""
    return Path(source).name or f"record {index + 1}"


def ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates by the criterion, best first."""
    return sorted(candidates, key=lambda c: -c.delta_bic)


def in_words(result: Mapping[str, Any]) -> list[str]:
    """Sentences that say what a trace found, the verdict first.

    Parameters
    ----------
    result
        As of :func:`to_dict`.
    """
    floor, before, after = result["noise_floor_deg"], result["before"]["heldout"], result["after"]["heldout"]
    error = f"{before['rmse_deg']:.3g} deg rms on data held out of the fit, the noise is {floor:.3g} deg"
    names = " and ".join(effect["name"] for effect in result["effects"])
    left = f"With {names} in the model {after['rmse_deg']:.3g} deg is left in place of {error}."
    reasons = [text[:1].upper() + text[1:] + "." for text in result["words"]]
    match result["verdict"]:
        case "none":
            return [f"No effect is missing: the declared model leaves {error}.", *reasons]
        case "effect":
            return [f"The residual is traced to {names}.", left, *reasons]
        case "ambiguous":
            others = [
                f"{e['name']} or {' or '.join(e['confusable_with'])}" for e in result["effects"] if e["confusable_with"]
            ]
            alike = f"These records do not tell them apart (criterion within {result['alike']:.0f})."
            return [f"The residual is traced to one of several: {'; '.join(others)}.", alike, left, *reasons]
    nearest = [c for c in result["candidates"] if c["heldout_rmse_deg"] is not None][:1]
    return [
        "Something is left that no effect of the catalogue explains.",
        f"The declared model leaves {error}.",
        *reasons,
        *(f"Nearest came {c['name']}, which would leave {c['heldout_rmse_deg']:.3g} deg." for c in nearest),
    ]


def _pair(errors: tuple[Errors, Errors]) -> dict[str, dict[str, float]]:
    return {"train": errors[0].to_dict(), "heldout": errors[1].to_dict()}


def _effects(trace: Trace, found: Sequence[Mapping[str, Parameter]]) -> list[dict[str, Any]]:
    """Effects of the grown model in the order in which they were added, each with what it brought."""
    stages = [_stage(trace, k) for k in range(len(trace.effects) + 1)]
    return [
        {
            "name": added.effect.name,
            "parameters": {name: p.to_dict() for name, p in values.items()},
            "confusable_with": list(confusable),
            "delta_bic": stages[k + 1][1] - stages[k][1],
            "heldout_rmse_deg": stages[k + 1][0].heldout_rmse_deg,
        }
        for k, (added, values, confusable) in enumerate(zip(trace.effects, found, trace.confusable, strict=True))
    ]


def _dependences(trace: Trace, fitted: Fitted) -> list[dict[str, Any]]:
    """Give what the residual goes with, as plain values."""
    return [asdict(one) for one in dependences(fitted, trace.records)]


def _stage(trace: Trace, k: int) -> tuple[Fitted, float]:
    """Model with the first k effects, and how much lower its criterion is than the declared model's."""
    if k == 0:
        return trace.baseline, 0.0
    there = [c for c in trace.candidates if set(c.names) == set(trace.augmented.names[:k])]
    if not there:  # an effect between was left out as needless
        return _stage(trace, k - 1)
    best = max(there, key=lambda c: c.delta_bic)
    return best.fitted, best.delta_bic


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "name": " + ".join(candidate.names),
        "heldout_rmse_deg": candidate.fitted.heldout_rmse_deg,
        "delta_bic": candidate.delta_bic,
    }


def _finite(value: Any) -> Any:
    """Replace numbers that JSON does not know by None, numpy's by Python's."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def fitted_parameters(fitted: Fitted, samples: float) -> list[dict[str, Parameter]]:
    """Values of the declared model's constants and of each effect's, with 95 % intervals from the Jacobian."""
    J, seen = fitted.jacobian[fitted.holdout.seen], int(fitted.holdout.seen.sum())
    count = max(2.0, samples * seen / fitted.row.size)
    variance = float(fitted.train @ fitted.train) / max(1, seen - J.shape[1]) * seen / count
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-12)
    _, singular, basis = np.linalg.svd(J / scale, full_matrices=False)
    singular = np.maximum(singular, 1e-9 * singular[0])
    deviation = np.sqrt(variance * ((basis.T / singular) ** 2).sum(axis=1)) / scale
    half = float(student.ppf(0.975, max(1.0, count - J.shape[1]))) * deviation
    shown = [
        (
            c.name,
            Parameter(
                c.from_unit(x),
                max(c.low, c.from_unit(max(x - h, c.to_unit(c.low)))),
                min(c.high, c.from_unit(min(x + h, c.to_unit(c.high)))),
                c.unit,
            ),
        )
        for c, x, h in zip(fitted.model.parameters, fitted.x.tolist(), half.tolist(), strict=True)
    ]
    out, at = [dict(shown[: fitted.model.own])], fitted.model.own
    for added in fitted.model.added:
        out.append(dict(shown[at : at + len(added.form.parameters)]))
        at += len(added.form.parameters)
    return out


def errors_of(fitted: Fitted) -> tuple[Errors, Errors]:
    """Errors of the fitted samples, and of those held out."""
    observed, seen = np.concatenate(fitted.model.problem.observed), fitted.holdout.seen
    predicted = observed + fitted.row
    return errors(observed[seen], predicted[seen]), errors(observed[~seen], predicted[~seen])
