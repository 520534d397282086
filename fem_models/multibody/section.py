"""Superelastic sections as Exudyn items: two coordinates for each notch, and fibres as connectors between them.

The coordinates are bending phi and elongation g of the section (:mod:`fem_models.joint.superelastic_section`). A fibre
is a connector over both, of the length g - y phi. A linear element of the two rings' rotations and of phi is the
elastic roots. A spring along the notch, longer by g, carries the thrust of the tendons: the beam has no axial stiffness
then, and keeps the shear.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np

import fem_models.multibody.connector_laws as laws
from fem_models.joint import JointRow
from fem_models.joint.superelastic_section import SuperelasticSection, elongation_under_mm
from hysteresis.arrays import Floats, Ints

STIFF_ROOTS, STIFF_LINK = 1e4, 1e2  # over the section's stiffness, where it has nothing elastic in series


@dataclass(frozen=True)
class Sections:
    """Connectors of the fibres, fibre by fibre, joint by joint; nodes of the coordinates, joint by joint.

    ``heat`` are springs that lead the search for the temperature, joint by joint; none without self-heating.
    """

    fibres: list[int]
    heat: list[int]
    bent: list[int]
    longer: list[int]

    def coordinates(self, mbs: Any) -> tuple[Ints, Ints]:
        """Coordinates of bending and elongation, shapes (N,), of an assembled system."""
        bent, longer = ([mbs.GetNodeODE2Index(n) for n in nodes] for nodes in (self.bent, self.longer))
        return np.array(bent, dtype=int), np.array(longer, dtype=int)


class SectionRow(NamedTuple):
    """Superelastic sections of all joints: what differs from joint to joint, and the law that they share.

    Heights and areas of the fibres have the shape (k, N), lengths and heats (:class:`Heating`, 0 without) (N,).
    """

    law: SuperelasticSection
    height_mm: Floats
    area_mm2: Floats
    length_mm: Floats
    heat: Floats


def section_row(joints: JointRow) -> SectionRow | None:
    """Sections of a rig's joints; None where the rig has no superelastic law, or measured joints."""
    if (law := joints.first.section) is None:
        return None
    return SectionRow(
        law=law,
        height_mm=joints.of("section.height_mm").T,
        area_mm2=joints.of("section.area_mm2").T,
        length_mm=joints.of("section.length_mm"),
        heat=joints.of("section.heating.heat") if law.heating else np.zeros(len(joints.each)),
    )


def axial_stiffness(section: SuperelasticSection) -> float:
    """Elastic stiffness of the section over its length, N/mm."""
    return section.young * float(section.area_mm2.sum()) / section.length_mm + section.elastic_N_per_mm


def link_stiffness(section: SuperelasticSection) -> float:
    """Stiffness in series with the section along the notch, N/mm."""
    stiff = STIFF_LINK * axial_stiffness(section)
    return min(1 / section.axial_compliance, stiff) if section.axial_compliance > 0 else stiff


def shortening_mm(section: SuperelasticSection, thrust_N: float) -> float:
    """How much shorter a notch is under a thrust."""
    return thrust_N / link_stiffness(section) - elongation_under_mm(section, thrust_N)


def add_sections(mbs: Any, joints: JointRow, ends: list[tuple[int, int]], thrust_N: float, ground: int) -> Sections:
    """Add the section of each notch between two nodes of rings, its turning length apart without load; none without.

    ``ground`` is the marker of a fixed coordinate. The sections start under a thrust.
    """
    markers, bent, longer, row = [], [], [], section_row(joints)
    if row is None:
        return Sections([], [], [], [])
    for joint, (near, far) in zip(joints.each, ends, strict=True):
        section = joint.section
        assert section is not None
        at_start = elongation_under_mm(section, thrust_N)
        nodes = [mbs.AddNode(items.Node1D(initialCoordinates=[at])) for at in (0.0, at_start)]
        mbs.AddObject(items.ObjectMass1D(mass=0.0, nodeNumber=nodes[1]))
        turn, stretch = (mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in nodes)
        _add_roots(mbs, section, [near, far, nodes[0]])
        _add_link(mbs, section, (near, far), stretch, ground, joint.turning_length_mm)
        if section.elastic_N_per_mm > 0:
            share = items.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[ground, stretch], stiffness=section.elastic_N_per_mm
            )
            mbs.AddObject(share)
        markers.append([turn, stretch])
        bent.append(nodes[0])
        longer.append(nodes[1])
    stiffness = row.law.young * row.area_mm2 / row.length_mm
    fibres = [
        laws.add_with_law(
            mbs,
            items.ObjectConnectorCoordinateSpringDamperExt(markerNumbers=pair, factor0=-height, stiffness=k),
            laws.fibre if row.law.upper == row.law.upper_pressed else laws.fibre_of_two_sides,
        )
        for heights, stiff in zip(row.height_mm.tolist(), stiffness.tolist(), strict=True)
        for pair, height, k in zip(markers, heights, stiff, strict=True)
    ]
    heat = [
        laws.add_with_law(mbs, items.ObjectConnectorCoordinateSpringDamperExt(markerNumbers=pair), laws.linear)
        for pair in (markers if row.law.heating else [])
    ]
    return Sections(fibres, heat, bent, longer)


def _add_roots(mbs: Any, section: SuperelasticSection, nodes: list[int]) -> None:
    """Energy of the roots, k (rotation of far less near ring less bending of the section)^2/2: a constant matrix."""
    bending = section.young * float(section.area_mm2 @ section.height_mm**2) / section.length_mm
    stiff = STIFF_ROOTS * bending
    stiffness = min(1 / section.root_compliance, stiff) if section.root_compliance > 0 else stiff
    row = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 1.0, -1.0])
    mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes, massMatrix=np.zeros((7, 7)), stiffnessMatrix=stiffness * np.outer(row, row)
        )
    )


def _add_link(
    mbs: Any, section: SuperelasticSection, ends: tuple[int, int], stretch: int, ground: int, length_mm: float
) -> None:
    """Spring from ring to ring, in compression too, whose length counts without the elongation of the section."""
    points = [mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=n)) for n in ends]
    link = items.ObjectConnectorReevingSystemSprings(
        markerNumbers=[*points, stretch, ground],
        hasCoordinateMarkers=True,
        coordinateFactors=[1.0, 1.0],  # Exudyn subtracts them
        stiffnessPerLength=link_stiffness(section) * length_mm,
        referenceLength=length_mm,
        regularizationForce=-1.0,  # below 0: pushes as it pulls
        sheavesAxes=exu.Vector3DList([[0, 0, 1]] * 2),
        sheavesRadii=[0.0, 0.0],
    )
    mbs.AddObject(link)


def fibre_lengths_mm(row: SectionRow, bent: Floats, longer: Floats) -> Floats:
    """Elongations of the fibres of all joints, shape (k, N), at coordinates of shape (N,)."""
    return longer + row.height_mm * bent
