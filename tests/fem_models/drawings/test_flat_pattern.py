"""The flat pattern against the tube that it is unrolled from, and DXF there and back."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_models.drawings.beam import cut_height_of_angle_mm, half_angle_rad
from fem_models.drawings.pattern import flat_pattern
from fem_models.joint.section import cut_height_mm, section
from fem_models.rig import RigError, preset
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.layout import Layout
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import notched_tube, with_notch
from studies.drawings.imported import Reading, rig_of_drawing
from studies.drawings.written import DrawingChoice, write_drawing

pytest.importorskip("ezdxf", reason="ezdxf is not installed: the extras drawing and dev have it")
WRIST = preset("notched-wrist-90")
ROOTS = (0.0, 0.3, 0.8, 1.0)
UNEQUAL = with_notch(
    preset("du2018"), Notch("v_pair", 4, (2.5, 2.7, 2.8, 2.6), (1.0, 1.2, 1.4, 1.1), (1.2, 0.9, 1.0, 0.7), ROOTS)
)
SLITS = Notch("rectangular", 4, (1.0, 1.1, 1.2, 1.3), 0.4, (0.5, 0.6, 0.7, 0.8))
TURNED = replace(
    with_notch(replace(WRIST, superelastic=None), SLITS), layout=Layout((-30.0, 0.0, 45.0, 170.0), (0.0,), (1,))
)
SLOTS = with_notch(preset("du2018"), Notch("rectangular_pair", 6, 2.4, 0.7, 1.1))


def test_planes_leave_the_outline_on_the_outer_surface():
    """Every vertex lies on the plane of its place along the tube; a flat root is as long as the rig says."""
    rig = preset("du2018")
    pattern, joint = flat_pattern(rig), notched_tube(rig)
    outline, radius = pattern.outlines[0], joint.tube.outer_diameter_mm / 2
    along, around = (outline.points_mm - outline.middle_mm).T
    assert radius * np.cos(around / radius) == pytest.approx(cut_height_mm(joint, along), abs=1e-9)
    assert np.ptp(along[around > around.max() - 1e-9]) == pytest.approx(joint.cut.root_width_mm, abs=1e-9)


@pytest.mark.parametrize("depth", [0.7, 1.4, 1.5])
@pytest.mark.parametrize("one_sided", [True, False])
def test_radial_cuts_leave_the_second_moment_of_the_planes(depth, one_sided):
    """Of a sector by quadrature; and the angle goes back to the depth."""
    tube, share = Tube(1.62, 1.40), 1.0 if one_sided else 0.5
    shape = "rectangular" if one_sided else "rectangular_pair"
    joint = NotchedTube(tube, Notch(shape, 1, share * depth, 0.5, 1.0))
    cut = float(cut_height_mm(joint, 0.0))
    half = half_angle_rad(tube, cut, one_sided=one_sided, beam="radial")
    turn = np.linspace(half, math.pi * (2 if one_sided else 1) - half, 20001)
    edges = (0.81**4 - 0.7**4) / 4, (0.81**3 - 0.7**3) / 3, (0.81**2 - 0.7**2) / 2
    second, first, area = (
        power * np.trapezoid(np.cos(turn) ** k, turn) for power, k in zip(edges, (2, 1, 0), strict=True)
    )
    central = second - first**2 / area if one_sided else 2 * second
    assert central == pytest.approx(float(section(joint, 0.0).second_moment_mm4), rel=1e-6)
    assert cut_height_of_angle_mm(tube, half, one_sided=one_sided, beam="radial") == pytest.approx(cut, abs=1e-9)


@pytest.mark.parametrize("kerf", [0.02, 0.05, 0.3])
def test_a_beam_along_the_path_takes_the_notch(kerf):
    """Points of the path are half a kerf from the edge of the notch, by the distance to its polygon."""
    rig = preset("du2018")
    edge, path = (flat_pattern(rig, kerf_mm=width).outlines[3].points_mm for width in (0.0, kerf))
    one, other = edge, np.roll(edge, -1, axis=0)
    way = other - one
    for point in path[::3]:
        share = np.clip(((point - one) * way).sum(axis=1) / (way**2).sum(axis=1), 0, 1)
        off = np.linalg.norm(one + share[:, None] * way - point, axis=1).min()
        assert off == pytest.approx(kerf / 2, abs=2e-4)


def test_angles_run_down_the_sheet_and_the_seam_meets_no_notch():
    pattern = flat_pattern(TURNED)
    places = [one.middle_mm[1] for one in pattern.outlines]
    assert places[1] - places[2] == pytest.approx(math.radians(45) * 0.81)
    assert not any(one.crosses_seam for one in flat_pattern(preset("du2018")).outlines)
    assert flat_pattern(preset("du2018")).seam_deg == 90.0
    assert flat_pattern(WRIST, seam_deg=0.0).outlines[0].crosses_seam


def rigs():
    known = (preset("du2018"), WRIST, preset("notched-wrist-150"), any_preset("zhang2026"), UNEQUAL, TURNED, SLOTS)
    return [pytest.param(rig, id=f"{rig.name}-{rig.joints}") for rig in known]


@pytest.mark.parametrize("beam", ["plane", "radial"])
@pytest.mark.parametrize("kerf", [None, 0.025])
@pytest.mark.parametrize("rig", rigs())
def test_dxf_there_and_back(rig, kerf, beam, tmp_path):
    """The issue: every dimension within 0.01 mm. Found: within 2e-5 mm."""
    path = write_drawing(rig, tmp_path / "flat.dxf", to="dxf", choice=DrawingChoice(kerf, beam))
    found = rig_of_drawing(path, rig, Reading())
    assert type(found) is type(rig)
    one, other = found.to_dict()["notch"], rig.to_dict()["notch"]
    assert one.keys() == other.keys()
    for name, value in other.items():
        if isinstance(value, str | bool):
            assert one[name] == value
        else:
            n = rig.joints if name != "count" else 1
            off = np.abs(np.broadcast_to(one[name], n) - np.broadcast_to(value, n))
            if name == "turn_deg":  # a pair looks alike after half a turn
                off = np.minimum(off, np.abs(off - (360.0 if other["shape"] == "rectangular" else 180.0)))
            assert off.max() < 1e-4
    if np.isscalar(other["depth_mm"]) and other.get("turn_deg", 0.0) == 0.0:
        assert found == rig


def test_drawing_of_notchbend_is_clean(tmp_path):
    import ezdxf

    for number, rig in enumerate((UNEQUAL, TURNED, any_preset("zhang2026"))):
        path = tmp_path / f"{number}.dxf"
        write_drawing(rig, path, to="dxf", choice=DrawingChoice(0.03))
        drawing = ezdxf.readfile(path)
        audit = drawing.audit()
        assert not audit.errors
        assert not audit.fixes
        assert drawing.units == ezdxf.units.MM
        layers = {entity.dxf.layer for entity in drawing.modelspace()}
        assert {"CUT", "NOTCH", "SHEET", "SEAM", "AXIS", "TENDON", "DIM", "NOTES"} <= layers
        measured = {round(one.get_measurement(), 3) for one in drawing.modelspace().query("DIMENSION")}
        joint = notched_tube(getattr(rig, "rig", rig))
        assert {joint.notch.at(0).width_mm, joint.notch.at(0).spacing_mm} <= measured
        assert write_drawing(rig, tmp_path / "again.dxf", to="dxf", choice=DrawingChoice(0.03)).read_text() == (
            path.read_text()
        )


def by_hand(path: Path, unit: int, draw) -> Path:
    import ezdxf

    drawing = ezdxf.new()
    drawing.units = unit
    draw(drawing.modelspace())
    drawing.saveas(path)
    return path


def lines(space, *corners):
    for one, other in zip(corners, corners[1:] + corners[:1], strict=True):
        space.add_line(one, other)


def test_slots_of_another_program_in_inches(tmp_path):
    """Loose lines; arcs of 2 mm about one side; 25.4 mm an inch."""
    depth = 0.81 - 0.81 * math.cos(1.0 / 0.81)

    def draw(space):
        for k in range(3):
            x = (2.0 + 1.5 * k) / 25.4
            lines(space, (x, 0.04), (x + 0.5 / 25.4, 0.04), (x + 0.5 / 25.4, 0.04 + 2 / 25.4), (x, 0.04 + 2 / 25.4))

    found = rig_of_drawing(by_hand(tmp_path / "a.dxf", 1, draw), WRIST, Reading())
    notch = notched_tube(found).notch
    assert (notch.shape, notch.count, notch.width_mm, notch.spacing_mm) == ("rectangular", 3, 0.5, 1.0)
    assert notch.depth_mm == pytest.approx(depth, abs=1e-5)


def test_an_outline_that_the_seam_divides_is_one_notch(tmp_path):
    round_mm = math.pi * 1.62

    def draw(space):
        for x in (1.0, 2.5):
            for low, high in ((0.0, 1.1), (round_mm - 1.1, round_mm)):
                space.add_lwpolyline([(x, low), (x + 0.5, low), (x + 0.5, high), (x, high)], close=True)

    found = rig_of_drawing(by_hand(tmp_path / "a.dxf", 4, draw), WRIST, Reading())
    assert notched_tube(found).notch.count == 2
    assert notched_tube(found).notch.depth_mm == pytest.approx(0.81 - 0.81 * math.cos(1.1 / 0.81), abs=1e-5)


def square(x, y, wide, tall):
    return lambda space: space.add_lwpolyline(
        [(x, y), (x + wide, y), (x + wide, y + tall), (x, y + tall)], close=True, dxfattribs={"layer": "A"}
    )


@pytest.mark.parametrize(
    ("unit", "draws", "how", "said"),
    [
        (0, [square(1, 1, 0.5, 2)], Reading(), r"\$INSUNITS = 0: expected a unit in the header, or --unit"),
        (4, [], Reading(), "no closed outlines: expected a layer CUT, or --layer"),
        (4, [square(1, 1, 0.5, 2)], Reading(layer="b"), "layer b: expected one with closed outlines: A"),
        (4, [square(1, 1, 0.5, 2), square(1.2, 4, 0.5, 0.5)], Reading(), "notches 1 and 2 overlap"),
        (4, [square(1, 0, 0.5, 1), square(1, 2.2, 0.5, 1)], Reading(), "expected at most 0.02 mm of both"),
        (4, [square(1, 1, 0.5, 2)], Reading(beam="square"), "expected one of plane, radial"),
        (4, [square(1, 1, 0.5, 2)], Reading(kerf_mm=-1), "kerf_mm = -1: expected at least 0"),
        (4, [lambda s: lines(s, (1, 0), (2, 2), (1, 4))], Reading(), "expected a slot, as notches on one side are"),
    ],
)
def test_refuses_in_one_line(unit, draws, how, said, tmp_path):
    def draw(space):
        for one in draws:
            one(space)

    with pytest.raises(RigError, match=said) as error:
        rig_of_drawing(by_hand(tmp_path / "a.dxf", unit, draw), WRIST, how)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("rig", "given", "said"),
    [
        (WRIST, {"kerf_mm": 0.6}, "kerf_mm = 0.6: expected at least 0, below notch.width_mm = 0.5"),
        (with_notch(WRIST, Notch("rectangular", 2, 0.1, 0.5, 1.0)), {}, "expected above the wall of 0.11 mm"),
    ],
)
def test_refuses_what_cannot_be_cut(rig, given, said):
    with pytest.raises(RigError, match=said):
        flat_pattern(rig, **given)
