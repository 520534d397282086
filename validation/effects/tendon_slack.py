"""Ropes longer than the preload asks for."""

from __future__ import annotations

from dataclasses import replace

from fem_models.effects import Slack
from fem_models.rig import Rig
from validation.effect import Constant, Effect, Need, RigForm, Scale, Values

SLACK = Constant("slack_mm", "mm", 0.0, 5.0, 0.05)
CENTRE = Constant("centre_mm", "mm", -5.0, 5.0, 0.05)


def _rig(rig: Rig, values: Values) -> Rig:
    here = rig.slack or Slack()
    more, centre = values["slack_mm"], values.get("centre_mm", 0.0)
    return replace(rig, slack=Slack(here.tendon_a_mm + more + centre, here.tendon_b_mm + more - centre))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"slack_mm": part * scale.drive} for part in (0.02, 0.08, 0.2)]


def _off_centre(scale: Scale, rig: Rig) -> list[Values]:
    return [
        {"slack_mm": part * scale.drive, "centre_mm": side * 0.02 * scale.drive}
        for part in (0.04, 0.12)
        for side in (-1, 1)
    ]


_TWO: frozenset[Need] = frozenset({"two tendons"})

EFFECT = Effect(
    name="tendon_slack",
    physics="Ropes that are longer than the declared preload asks for carry nothing about the centre, where neither is "
    "taut and the tube does not move: a dead zone at a position of the drive, the same on the way up and down. "
    "A rope pulls and never pushes (unilateral tendon, as in fem_models.multibody).",
    tell_apart="Backlash comes after every reversal, slack at one position. A record with more preload has less of it.",
    rig_forms=(
        RigForm((SLACK,), _starts, rig=_rig, needs=_TWO),
        RigForm((SLACK, CENTRE), _off_centre, rig=_rig, needs=_TWO),
    ),
)
