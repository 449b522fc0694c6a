"""URDF files give the tree that they say, and damaged ones a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from phasmid.formats import Severity, read_urdf

DATA = Path(__file__).parents[2].parent / "shared" / "data"
HUMA = DATA / "phantomx_description" / "urdf" / "phantomx.urdf"
INTERBOTIX = DATA / "interbotix_xshexapod_descriptions" / "urdf" / "pxmark4.urdf"

needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the example robots are not at hand")


@needs_data
def test_the_humarobotics_phantomx_is_read_and_its_lost_mesh_named() -> None:
    tree = read_urdf(HUMA)
    assert (len(tree.links), len(tree.joints)) == (26, 25)
    assert tree.root.name == "base_link"
    assert sum(joint.kind == "revolute" for joint in tree.joints) == 18
    lost, shown, ignored = tree.findings
    assert lost.severity is Severity.SUSPECT
    assert lost.where == "phantomx.urdf, line 24"
    assert lost.what == (
        'mesh "package://phantomx_description/meshes/body.STL" is not there; it was left out.'
    )
    assert shown.what == "link MP_BODY shows its collision shape, as it has no visual one."
    assert ignored.what == "26 <gazebo>, 18 <transmission> were ignored."


@needs_data
def test_the_interbotix_phantomx_is_read_with_its_meshes_in_metres() -> None:
    tree = read_urdf(INTERBOTIX)
    assert (len(tree.links), len(tree.joints)) == (26, 25)
    joint = next(j for j in tree.joints if j.name == "right_front_coxa")
    assert (joint.effort, joint.friction) == (3.0, 0.5)
    assert joint.upper == 0.9599310885968813
    np.testing.assert_array_equal(joint.X_parent_child[:3, 3], [0.125, -0.065, 0])
    (trunk,) = tree.root.parts
    # The trunk of a PhantomX is about 260 mm long.
    assert 0.2 < float(np.ptp(trunk.vertices, axis=0).max()) < 0.3
    (ignored,) = tree.findings
    assert ignored.what == "1 <texture>, 18 <transmission> were ignored."
