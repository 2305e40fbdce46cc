"""Geometry: a depth image to points of the base frame, and their way to separate objects, beside other libraries.

The first table back-projects a full 640x480 frame. labkit checks its arguments, marks holes with NaN and gives an image
of points; the text's listing has a mask of all pixels; Open3D gets its image ready-made and returns a list of points;
cv2.depthTo3d stays in the camera frame, checks nothing and turns a hole into a point at the camera. The second table
starts from the points of three targets in a 320x240 frame: outliers removed, then one cloud an object.
"""

import cv2
import numpy as np
import open3d
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bench.measure import in_turns, table
from labkit.geometry import (
    back_project,
    back_project_to_base,
    cluster_indices,
    inlier_indices,
    invert_transform,
    masked_cloud_to_base,
    principal_axes,
)
from labkit.sim.spec import Camera

TURNS, REPEATS = 30, 5
RADIUS, MIN_NEIGHBOURS, GAP = 0.01, 4, 0.015


def camera(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Look down at the table from 0.9 m: K and T_base_cam."""
    f = 1.2 * height
    K = np.array([[f, 0.0, (width - 1) / 2], [0.0, f, (height - 1) / 2], [0.0, 0.0, 1.0]])
    return K, np.array(Camera.looking_at((0.5, 0.0, 0.0), 0.9, 0.4, 0.9).T_base_cam)


def scene(width: int, height: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """See three balls on a table, with a millimetre of noise: depth, mask (2 = ball), K, T_base_cam."""
    K, T_base_cam = camera(width, height)
    rays = back_project_to_base(np.ones((height, width), np.float32), K, T_base_cam) - T_base_cam[:3, 3]
    rng = np.random.default_rng(0)
    depth = -T_base_cam[2, 3] / rays[..., 2]
    mask = np.ones((height, width), np.uint8)
    for centre in ((0.4, -0.15, 0.04), (0.5, 0.1, 0.04), (0.62, -0.02, 0.04)):
        to_centre = np.array(centre) - T_base_cam[:3, 3]
        a, b = (rays**2).sum(axis=-1), rays @ to_centre
        inside = b**2 - a * (to_centre @ to_centre - 0.04**2)
        ball = inside > 0.0
        depth[ball] = ((b - np.sqrt(np.maximum(inside, 0.0))) / a)[ball]
        mask[ball] = 2
    return (depth + rng.normal(0.0, 0.001, depth.shape)).astype(np.float32), mask, K, T_base_cam


def text_listing(mask, depth, K, T_base_cam, target_class):
    """Follow the steps of the listing in the text's section 6."""
    v, u = np.where(mask == target_class)
    ones = np.ones_like(u, dtype=np.float32)
    pixels = np.stack([u.astype(np.float32), v.astype(np.float32), ones], axis=0)
    depths = depth[v, u].astype(np.float32)
    P_cam = (np.linalg.inv(K) @ pixels) * depths
    P_base = T_base_cam @ np.vstack([P_cam, ones])
    return P_base[:3, :].T


def with_open3d(depth, K, T_base_cam):
    """Prepare Open3D's call: it wants the inverse pose, and its own types."""
    height, width = depth.shape
    image = open3d.geometry.Image(depth)
    intrinsic = open3d.camera.PinholeCameraIntrinsic(width, height, K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    T_cam_base = invert_transform(T_base_cam)
    create = open3d.geometry.PointCloud.create_from_depth_image
    return lambda: create(image, intrinsic, T_cam_base, depth_scale=1.0, depth_trunc=100.0)


def with_scipy(P):
    """Remove the same outliers and find the same clusters, exactly, with k-d trees and a sparse graph."""
    count = cKDTree(P).query_ball_point(P, RADIUS, return_length=True)
    P = P[count - 1 >= MIN_NEIGHBOURS]
    i, j = cKDTree(P).query_pairs(GAP, output_type="ndarray").T
    graph = coo_matrix((np.ones(len(i), bool), (i, j)), shape=(len(P), len(P)))
    _, group = connected_components(graph, directed=False)
    return [P[group == g] for g in np.argsort(-np.bincount(group))]


def clouds_with_open3d(P):
    """Do the same with Open3D's radius outlier removal and DBSCAN, from array to arrays."""
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(P))
    cloud, _ = cloud.remove_radius_outlier(MIN_NEIGHBOURS, RADIUS)
    group, P = np.asarray(cloud.cluster_dbscan(GAP, 1)), np.asarray(cloud.points)
    return [P[group == g] for g in np.argsort(-np.bincount(group))]


def against_the_first(title: str, ways: dict, bars: dict[str, str]) -> str:
    """Time the ways; the first is labkit's, which the others are compared with."""
    ms = {name: float(np.median(turns)) for name, turns in in_turns(ways, TURNS, best_of=REPEATS).items()}
    own = ms[next(iter(ways))]
    rows = [(name, f"{ms[name]:.2f}", f"{ms[name] / own:.2f}", bars.get(name, "")) for name in ways]
    return table(f"{title} | median ms | times the first row | asked for", rows)


def frame_table() -> str:
    """Back-project a full 640x480 frame in every way."""
    depth, mask, K, T_base_cam = scene(640, 480)
    everything = np.ones_like(mask)
    holes = np.where(np.random.default_rng(1).random(depth.shape) < 0.1, np.float32(0.0), depth)
    poses = iter(np.linspace(0.0, 3.0, (TURNS + 1) * REPEATS))

    def new_camera():
        moved = np.array(Camera.looking_at((0.5, 0.0, 0.0), 0.9, next(poses), 0.9).T_base_cam)
        return back_project_to_base(depth, K, moved)

    ways = {
        "labkit, base frame": lambda: back_project_to_base(depth, K, T_base_cam),
        "labkit, base frame, a tenth of the pixels are holes": lambda: back_project_to_base(holes, K, T_base_cam),
        "labkit, base frame, the camera moves every frame": new_camera,
        "labkit, camera frame": lambda: back_project(depth, K),
        "the text's listing": lambda: text_listing(everything, depth, K, T_base_cam, 1),
        "Open3D create_from_depth_image": with_open3d(depth, K, T_base_cam),
        "cv2.depthTo3d, camera frame": lambda: cv2.depthTo3d(depth, K),
    }
    P = ways["labkit, base frame"]().reshape(-1, 3)
    np.testing.assert_allclose(ways["the text's listing"](), P, atol=1e-5)
    np.testing.assert_allclose(ways["Open3D create_from_depth_image"]().points, P, atol=1e-5)
    peer = ways["cv2.depthTo3d, camera frame"]()[..., :3]
    np.testing.assert_allclose(peer, back_project(depth, K), atol=1e-5)
    bars = {
        "the text's listing": "at least 15",
        "Open3D create_from_depth_image": "at least 2",
        "cv2.depthTo3d, camera frame": f"at least {1 / 1.5:.2f}",
    }
    return against_the_first("640x480, full frame", ways, bars)


def cloud_table() -> str:
    """Turn the points of three targets into three clouds in every way."""
    depth, mask, K, T_base_cam = scene(320, 240)
    P = masked_cloud_to_base(mask, depth, K, T_base_cam, 2)

    def clouds(P):
        P = P[inlier_indices(P, RADIUS, MIN_NEIGHBOURS)]
        return [P[group] for group in cluster_indices(P, GAP)]

    def whole():
        points = back_project_to_base(depth, K, T_base_cam)[mask == 2]
        return [principal_axes(cloud) for cloud in clouds(points)]

    ways = {
        "labkit, inlier_indices and cluster_indices": lambda: clouds(P),
        "SciPy, k-d trees and connected_components": lambda: with_scipy(P),
        "Open3D remove_radius_outlier and cluster_dbscan": lambda: clouds_with_open3d(P),
        "labkit, all geometry of a frame: depth to three clouds with axes": whole,
    }
    expected = [len(cloud) for cloud in ways["labkit, inlier_indices and cluster_indices"]()]
    assert len(expected) == 3
    assert [len(cloud) for cloud in with_scipy(P)] == expected
    return against_the_first(f"320x240, three targets, {len(P)} points in all", ways, {})


def main() -> str:
    """Measure both tables and return them in Markdown."""
    return f"{frame_table()}\n\n{cloud_table()}"
