"""CalculiX as referee on the same mesh; what needs no program is tested without it."""

import shutil

import numpy as np
import pytest
from calculix import CalculixError, calculix_stiffness, read_reactions, write_input

from fem_models.rig import preset
from fem_models.rig.joints import Notch
from fem_models.rig.rig import with_notch
from fem_models.solid.linear import cells, end_nodes, snr_stiffness, solid_snr

RIG = preset("du2018")
RIGS = {
    "v_pair": RIG,
    "rectangular": with_notch(RIG, Notch("rectangular", 5, depth_mm=4.5, width_mm=1.5, spacing_mm=1.2)),
}


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed: apt-get install calculix-ccx")
@pytest.mark.parametrize("shape", RIGS)
def test_stiffness_is_that_of_calculix(shape):
    """The same mesh and rigid plates; C3D10 has four points of quadrature, which on curved elements is not all."""
    body = solid_snr(RIGS[shape], refinement=0.6)
    ours, theirs = snr_stiffness(body).stiffness, calculix_stiffness(body)
    scale = np.sqrt(np.outer(np.diag(ours), np.diag(ours)))
    assert np.abs((theirs - ours) / scale).max() < 0.005  # target: 0.5 %
    assert np.diag(theirs) == pytest.approx(np.diag(ours), rel=5e-4)  # what it is


def test_input_names_the_mesh_and_every_prescribed_displacement(tmp_path):
    body = solid_snr(RIG, refinement=0.5)
    write_input(body, tmp_path / "snr.inp")
    text = (tmp_path / "snr.inp").read_text()
    ends = sum(len(nodes) for nodes in end_nodes(body))
    assert text.count("*STEP") == 6
    assert sum(line.count(",") == 3 for line in text.splitlines()) == 6 * 3 * ends
    mesh = (tmp_path / "snr-mesh.inp").read_text()
    assert "TYPE=C3D10\n" in mesh
    assert f"\n{len(cells(body.mesh))}," in mesh


def test_reads_reactions_and_says_what_is_missing(tmp_path):
    file = tmp_path / "snr.dat"
    block = (
        "\n forces (fx,fy,fz) for set ENDS and time  0.1000000E+01\n\n  3 1.0E+00 2.0E+00 -3.0E-02\n  7 0.0 0.0 1.0\n"
    )
    file.write_text(2 * block)
    assert read_reactions(file, steps=2) == pytest.approx(np.array([[[1, 2, -0.03], [0, 0, 1]]] * 2))
    with pytest.raises(CalculixError, match="2 blocks of forces: expected 6"):
        read_reactions(file, steps=6)
    with pytest.raises(CalculixError, match="no-such-ccx"):
        calculix_stiffness(solid_snr(RIG, refinement=0.5), program="no-such-ccx")
