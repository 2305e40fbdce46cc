"""Views in 3-D hold what they were given, at the places where it is."""

import io
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labcourse.views import PLOTLY, View
from labkit.grasp import Grasp, Gripper


def test_jaws_stand_as_far_apart_as_the_grasp_says_and_reach_from_palm_to_tips():
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", [np.pi, 0.0, 0.7]).as_matrix()
    T[:3, 3] = 0.5, 0.1, 0.05
    hand = Gripper()
    (layer,) = View().jaws([Grasp(T, 0.042)], hand).layers
    in_grasp = (layer["P"].reshape(-1, 3) - T[:3, 3]) @ T[:3, :3]
    closing, approach = in_grasp[:, 1], in_grasp[:, 2]
    assert closing[closing > 0].min() - closing[closing < 0].max() == pytest.approx(0.042)
    assert approach.max() == pytest.approx(hand.tips_below_grasp)
    assert np.ptp(approach) == pytest.approx(hand.palm_above_tips)


def test_a_view_turns_in_jupyter_and_stands_still_elsewhere():
    P = np.random.default_rng(0).uniform(size=(50, 3))
    view = View("a cloud").points(P, "cloud", np.full((50, 3), 7, np.uint8)).frame(np.eye(4), "base")
    bundle = view._repr_mimebundle_()
    assert bundle["image/png"].startswith(b"\x89PNG")
    names = [trace["name"] for trace in bundle[PLOTLY]["data"]]
    assert names == ["cloud", "base x", "base y", "base z"]
    json.dumps(bundle[PLOTLY])
    cloud = view.plotly().data[0]
    assert np.allclose(np.stack([cloud.x, cloud.y, cloud.z], axis=1), P, atol=1e-6)
    assert set(cloud.marker.color) == {"rgb(7,7,7)"}


def test_a_box_is_closed_and_has_its_volume():
    corners = np.array([[[x, y, z] for z in (0.0, 3.0) for y in (0.0, 2.0) for x in (0.0, 1.0)]])
    mesh = View().boxes(corners, "box").plotly().data[0]
    vertices = np.stack([mesh.x, mesh.y, mesh.z], axis=1)
    a, b, c = (vertices[np.asarray(index)] for index in (mesh.i, mesh.j, mesh.k))
    assert abs(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0) == pytest.approx(6.0), "all faces look the same way"


@pytest.mark.parametrize("size", [(1.3, 1.2, 2.0), (0.12, 0.24, 0.09), (0.2, 3.0, 0.2)])
def test_everything_is_seen_before_anybody_turns_it(size):
    """Plotly's camera looks at the middle of a box of volume 1, and sees 22.5 degrees above and below it."""
    corners = np.array(list(np.ndindex(2, 2, 2))) * size
    view = View(eye=(1.2, -1.0, 0.5)).points(corners, "corners")
    camera = view.plotly().layout.scene.camera
    eye = np.array([camera.eye[axis] for axis in "xyz"])
    rays = (corners - corners.mean(axis=0)) / np.cbrt(np.prod(size)) - eye
    off = np.degrees(np.arccos(rays @ -eye / np.linalg.norm(rays, axis=1) / np.linalg.norm(eye)))
    assert 17.0 < off.max() < 22.5
    picture = view.picture()
    picture.savefig(io.BytesIO())
    (axes,) = picture.axes
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        x0, y0, x1, y1 = axis.label.get_window_extent().extents
        assert 0 <= x0 < x1 <= picture.bbox.width and 0 <= y0 < y1 <= picture.bbox.height, axis.label.get_text()
