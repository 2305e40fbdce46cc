"""The demo says why its first run takes long, and only then; its film shows the thing between the jaws."""

import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labcli.demo import FILM_SIZE, film_camera, said_if_long
from labkit.grasp import Grasp
from labkit.sim.world import intrinsics


def test_what_takes_long_is_said_and_what_does_not_is_not(capsys):
    with said_if_long("compiling", seconds=0.01):
        time.sleep(0.2)
    with said_if_long("never", seconds=60.0):
        pass
    assert capsys.readouterr().err == "compiling\n"


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.0, 4.5])
def test_the_film_shows_the_jaws_one_beside_the_other_before_and_after_the_lift(yaw):
    """However the hand is turned: the tips of its fingers stand left and right of the thing, at the same height."""
    T = np.eye(4)
    T[:3, :3] = (Rotation.from_euler("z", yaw) * Rotation.from_euler("x", np.pi)).as_matrix()
    T[:3, 3] = (0.5, -0.2, 0.03)
    camera = film_camera([Grasp(T, 0.05)], 0.0)
    K = intrinsics(camera.fov_y, *FILM_SIZE)
    T_cam_base = np.linalg.inv(np.array(camera.T_base_cam))
    for height in (0.0, 0.15):
        tips = T[:3, 3] + 0.04 * np.outer((-1, 1), T[:3, 1]) + (0.0, 0.0, height)
        pixels = (tips @ T_cam_base[:3, :3].T + T_cam_base[:3, 3]) @ K.T
        (u, v), (w, x) = pixels[:, :2] / pixels[:, 2:]
        assert abs(u - w) > 30 and abs(v - x) < 1
        assert min(u, w) > 0 and max(u, w) < FILM_SIZE[0] and min(v, x) > 0 and max(v, x) < FILM_SIZE[1]
