"""The rules by which folds name an effect, on errors that are set by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis.arrays import Floats
from validation.tracing.search.by_folds import _named, _taken

SHAPE = np.random.default_rng(3).normal(size=(2, 400))


def model(rms: float, *names: str, chosen: bool = False, uneven: float = 0.0) -> SimpleNamespace:
    """A model and its errors in two folds; ``uneven`` makes it better in one part of them and worse in another."""
    errors = rms * SHAPE * np.where(np.arange(400) < 200, 1 + uneven, 1 - uneven)
    return SimpleNamespace(names=names, errors=errors, chosen=chosen)


class Fits:
    """What the rules ask of the fits of the folds."""

    folds = (0, 1)

    def chosen(self, models: list[SimpleNamespace]) -> list[SimpleNamespace]:
        return [one for one in models if one.chosen] * 2

    def heldout(self, models: list[SimpleNamespace]) -> list[Floats]:
        return [one.errors[fold] for fold, one in zip(self.folds, models, strict=True)]

    def everywhere(self, one: SimpleNamespace) -> list[Floats]:
        return self.heldout([one, one])

    def best(self, models: list[SimpleNamespace]) -> SimpleNamespace:
        return min(models, key=lambda one: float(np.sum(one.errors**2)))


BEFORE = model(1.0)


@pytest.mark.parametrize(("rms", "is_named"), [(0.85, True), (0.95, False)])
def test_an_effect_is_named_where_it_leaves_less_than_nine_tenths(rms: float, is_named: bool):
    best = model(rms, "delay", chosen=True)
    step = _named(Fits(), BEFORE, [BEFORE] * 2, [BEFORE], [best])
    assert (step is not None) is is_named
    if step is not None:
        assert (step.fitted, step.alike) == (best, ())


def test_an_effect_that_the_folds_do_not_choose_is_not_named():
    assert _named(Fits(), model(1.0), [BEFORE] * 2, [model(0.5, chosen=True)], [model(0.5, "delay")]) is None


def test_a_gain_in_one_part_that_another_loses_is_not_named():
    """The mean square falls, but not beyond its interval: a few blocks make it."""
    lucky = model(1.0, "delay", chosen=True)
    lucky.errors = np.where(np.arange(400) < 40, 0.0, 1.02) * SHAPE
    before = model(1.0)
    before.errors = np.where(np.arange(400) < 40, 2.2, 1.0) * SHAPE
    step = _named(Fits(), before, [before] * 2, [before], [lucky])
    assert step is None


def test_effects_that_predict_as_well_are_not_distinguished():
    """Within 5 % of the best one's rms, or 1 % of what it takes; those that gain nothing are not among them."""
    best = model(0.1, "delay", chosen=True)
    near, far = model(0.1045, "drag"), model(0.2, "creep")
    step = _named(Fits(), BEFORE, [BEFORE] * 2, [BEFORE], [far, near, best])
    assert step is not None
    assert step.alike == ("drag",)
    idle = model(1.0, "wheel", uneven=0.02)
    again = _named(Fits(), BEFORE, [BEFORE] * 2, [BEFORE], [idle, model(0.139, "drag"), model(0.145, "creep"), best])
    assert again is not None
    assert again.alike == ("drag",)  # 0.1^2 + 0.01 (1 - 0.1^2) is 0.141^2


def test_a_step_takes_the_smaller_of_what_the_choices_and_the_named_model_take():
    step = SimpleNamespace(fitted=model(0.5, "delay"), chosen=[model(0.2, "delay")] * 2)
    chosen = [model(0.8)] * 2
    squares = float(np.mean(SHAPE**2))
    by_choices, by_named = 0.8**2 - 0.2**2, 1.0 - 0.5**2
    assert _taken(Fits(), BEFORE, chosen, step) == pytest.approx(min(by_choices, by_named) * squares, rel=1e-12)
