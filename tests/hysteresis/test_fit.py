"""The result of an identification: representations and tables."""

import dataclasses
import json

import numpy as np
import pytest

from hysteresis import Fit, Record, identify
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.bouc_wen import BoucWen, hysteresis

UP = np.linspace(-2.2, 2.2, 45)
DRIVE = np.concatenate([UP, UP[::-1][1:], UP[1:], UP[::-1][1:]])
CSV = ["drive", "angle_deg", "f_alone_deg", "predicted_deg", "heldout"]  # of `notchbend identify`


@pytest.fixture(scope="module")
def fit() -> Fit:
    angle = 20 * DRIVE + hysteresis(20 * DRIVE, BoucWen(-1.0, 0.3, 0.1, 1.5))
    records = [Record(DRIVE, angle, title="first"), Record(DRIVE, angle + 1.0, source="folder/second.csv")]
    return identify(records, lambda x: 20 * x, settings=IdentifySettings(generations=9))


def test_repr_is_one_line_with_law_and_error(fit: Fit) -> None:
    text = repr(fit)
    assert "\n" not in text
    assert text.startswith("Fit(first, second.csv: f analytic, A = -1, beta = ")
    assert len(text) < 250


def test_text_has_the_layer_or_its_saturation(fit: Fit) -> None:
    for shown in (fit.layer, {}):
        named = shown or {"saturation": fit.saturation_deg}
        text = str(dataclasses.replace(fit, layer=shown)).splitlines()
        end = next(i for i, line in enumerate(text) if line.startswith("  parameters of the paper: A = -1"))
        layer = text[1:end]
        assert len(layer) == len(named) > 0
        for line, value in zip(layer, named.values(), strict=True):
            assert line.endswith(str(value))
    assert "saturation" in layer[0]


def test_text_has_the_errors_with_hysteresis_and_without(fit: Fit) -> None:
    text = str(fit)
    for name, own, plain in (("train", fit.train, fit.baseline_train), ("held out", fit.heldout, fit.baseline_heldout)):
        words = f"{own.rmse_deg:.3g} deg rmse, {own.max_abs_deg:.3g} deg at most; without hysteresis"
        assert f"  {name:<8} {words} {plain.rmse_deg:.3g} deg\n" in text
    assert f"  noise floor: {fit.noise_floor_deg:.2g} deg" in text
    noted = dataclasses.replace(fit, notes=("a note",), warnings=("a warning",))
    assert str(noted).endswith("\n  note: a note\n  warning: a warning")
    alone = f"  Bouc-Wen alone: held out {noted.heldout.rmse_deg:.3g} deg rmse\n"
    assert alone in str(dataclasses.replace(fit, bouc_wen=noted))
    assert alone not in str(noted)


def test_text_fits_a_screen(fit: Fit) -> None:
    long = dataclasses.replace(
        fit, notes=(" ".join(["a note of many words"] * 12),), warnings=("no", "yes"), bouc_wen=fit
    )
    lines = str(long).splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) <= 24


def test_html_has_parameters_and_warnings(fit: Fit) -> None:
    html = fit._repr_html_()
    assert all(f">{name}<" in html for name in (*fit.parameters, "saturation_deg"))
    for value in fit.parameters.values():
        for end in (value.low, value.high):
            assert end is None or f">{end:.4g}<" in html
    assert all(f"warning: {text}".replace(">", "&gt;") in html for text in fit.warnings)


def test_tables_are_sample_by_sample(fit: Fit) -> None:
    frame = fit.to_dataframe(1)
    assert list(frame) == CSV
    np.testing.assert_array_equal(frame["predicted_deg"], fit.predict(DRIVE, record=1))
    np.testing.assert_array_equal(frame["heldout"], fit.heldout_masks[1])
    data = fit.to_xarray(1)
    assert [data[name].attrs["units"] for name in CSV] == ["mm", "deg", "deg", "deg", "1"]
    assert data.attrs["A"] == fit.parameters["A"].value
    assert data.attrs["record"] == "folder/second.csv"


def test_what_follows_from_the_records(fit: Fit) -> None:
    assert fit.records == ("first", "folder/second.csv")
    assert fit.drive_range == (-2.2, 2.2)
    assert (fit.first_drive, fit.drive_unit) == (-2.2, "mm")
    assert json.loads(json.dumps(fit.to_dict()))["records"] == ["first", "folder/second.csv"]


def test_settings_are_checked_where_they_are_made() -> None:
    with pytest.raises(ValueError, match="seeds = 0: expected at least 1"):
        IdentifySettings(seeds=0)
    with pytest.raises(ValueError, match="elements = 2: expected 1, 2 or None; 1 for the paper's fitness"):
        IdentifySettings(elements=2, fitness="paper-signed-mean")
