"""The whole tube as STEP and STL: volume by the sections of the notches, stiffness of a notch of it."""

import struct

import gmsh
import meshio
import numpy as np
import pytest
from scipy.integrate import quad
from skfem import MeshTet2

from fem_models.joint.section import section
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import notched_tube
from fem_models.solid import mesh
from fem_models.solid.linear import as_flexure, snr_stiffness, solid, solid_snr
from fem_models.solid.tube import tube_step, tube_stl

PRESETS = ("notched-wrist-90", "du2018", "zhang2026")


def planar(rig):
    return getattr(rig, "rig", rig)


def volume_of(rig):
    """Volume of the metal, mm^3: rings and the integral of the section over each notch (all alike)."""
    joint = notched_tube(planar(rig))
    cut, ring = joint.notch.at(0), np.pi / 4 * (joint.tube.outer_diameter_mm**2 - joint.tube.inner_diameter_mm**2)
    one = joint.of_joint(0)
    root, edge = (cut.root_width_mm or cut.width_mm) / 2, cut.width_mm / 2
    flank = quad(lambda z: float(section(one, z).area_mm2), root, edge)[0] if edge > root else 0.0
    notch = 2 * (root * float(section(one, 0.0).area_mm2) + flank)
    return joint.joints * notch + (joint.joints + 1) * cut.spacing_mm * ring


@pytest.mark.parametrize("name", [PRESETS[0], *(pytest.param(one, marks=pytest.mark.slow) for one in PRESETS[1:])])
def test_step_has_the_volume_and_the_length_of_the_tube(name, tmp_path, capfd):
    rig, path = any_preset(name), tmp_path / "tube.step"
    path.write_bytes(tube_step(rig))
    assert capfd.readouterr().out == ""
    with mesh.gmsh_session():
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        (solid_of_file,) = gmsh.model.occ.importShapes(str(path))
        found = gmsh.model.occ.getMass(*solid_of_file)
        *low, x1, _, z1 = gmsh.model.occ.getBoundingBox(*solid_of_file)
    joint = notched_tube(planar(rig))
    assert found == pytest.approx(volume_of(rig), rel=1e-5)
    assert z1 - low[2] == pytest.approx(joint.length_mm + joint.notch.at(0).spacing_mm, abs=1e-4)
    assert x1 - low[0] == pytest.approx(joint.tube.outer_diameter_mm, abs=1e-4)
    assert path.read_bytes() == tube_step(rig)


def quarter_of_step(path, rig, number):
    """Mesh one notch of the tube of a file: a quarter of it, mirrored twice, with the sizes of `validate`."""
    planar_rig = planar(rig)
    profile, size = mesh._profile(planar_rig, 0.0), mesh.mesh_size(planar_rig)
    joint = notched_tube(planar_rig)
    middle = joint.places().middles[number] + joint.notch.at(0).spacing_mm / 2
    with mesh.gmsh_session():
        occ, outer = gmsh.model.occ, profile.outer
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        tube = occ.importShapes(str(path))
        box = occ.addBox(-2 * outer, 0, middle, 4 * outer, 2 * outer, profile.half_pitch)
        kept = occ.intersect(tube, [(3, box)])[0]
        occ.translate(kept, 0, 0, -middle)
        occ.synchronize()
        mesh._grade(profile, size)
        mesh._generate(path.with_suffix(".msh"))
    quarter = meshio.read(path.with_suffix(".msh"), file_format="gmsh")
    used, corners = np.unique(quarter.cells_dict["tetra10"], return_inverse=True)
    points, cells = quarter.points[used], corners.reshape(-1, 10)
    for axis in (1, 2):
        points, cells = mesh._with_mirror_image(points, cells, axis)
    return MeshTet2(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), [("notched-wrist-90", 2), ("du2018", 6), ("zhang2026", 4)])
def test_step_bends_as_the_solid_of_validate(name, number, tmp_path):
    rig, path = any_preset(name), tmp_path / "tube.step"
    path.write_bytes(tube_step(rig))
    metal = planar(rig).material
    of_file = solid(quarter_of_step(path, rig, number), metal.youngs_modulus_GPa * 1e3, metal.poissons_ratio)
    found = as_flexure(snr_stiffness(of_file).stiffness)
    expected = as_flexure(snr_stiffness(solid_snr(planar(rig))).stiffness)
    print(name, found, expected)
    for key in ("bending_Nmm_per_rad", "shear_N_per_mm", "axial_N_per_mm"):
        assert getattr(found, key) == pytest.approx(getattr(expected, key), rel=0.01)


def volume_of_stl(content):
    """Volume, mm^3, that the triangles of a binary STL enclose, and how many there are."""
    (count,) = struct.unpack("<I", content[80:84])
    fields = np.frombuffer(content[84:], dtype=np.dtype([("xyz", "<f4", (4, 3)), ("more", "<u2")]), count=count)
    a, b, c = fields["xyz"][:, 1:].astype(float).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6), count


@pytest.mark.slow
@pytest.mark.parametrize("name", PRESETS)
def test_stl_encloses_the_metal(name):
    rig = any_preset(name)
    found, count = volume_of_stl(tube_stl(rig))
    assert found == pytest.approx(volume_of(rig), rel=0.01)
    assert count > 1000
