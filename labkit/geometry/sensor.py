"""What a real depth camera does to exact depth: steps, noise that grows with distance, holes at edges; and its pose."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from labkit.frame import RGBDFrame


@dataclass(frozen=True)
class DepthSensor:
    """A structured-light camera. sigma = noise * d^2, in metres at d metres; readings are whole `step`s, metres.

    Next to a jump of depth by more than `jump` metres a pixel is lost with probability `edge_loss`, anywhere else with
    `loss`. The defaults are of the size of a Kinect's (Khoshelham and Elberink, 2012).
    """

    noise: float = 0.0014
    step: float = 0.001
    jump: float = 0.02
    edge_loss: float = 0.5
    loss: float = 0.002

    def apply(self, frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
        """The frame as this sensor would have seen it; only depth changes, and holes become 0.

        >>> rgb, depth = np.zeros((2, 2, 3), np.uint8), np.ones((2, 2), np.float32)
        >>> frame = RGBDFrame(rgb, depth, np.diag([9.0, 9.0, 1.0]), np.eye(4))
        >>> DepthSensor(noise=0.0, step=0.3, loss=0.0).apply(frame, np.random.default_rng(0)).depth
        array([[0.9, 0.9],
               [0.9, 0.9]], dtype=float32)
        """
        return replace(frame, depth=self.measure(frame.depth, rng))

    def measure(self, depth: Float[np.ndarray, "H W"], rng: np.random.Generator) -> Float[np.ndarray, "H W"]:
        """Do the same to a depth image in metres, (H, W); float32, 0 where there is no reading."""
        depth = depth.astype(np.float64)
        known = np.isfinite(depth) & (depth > 0.0)
        depth = np.where(known, depth, 0.0)
        around = np.ones((3, 3), np.uint8)
        edge = cv2.dilate(depth, around) - cv2.erode(depth, around) > self.jump
        lost = rng.random(depth.shape) < np.where(edge, self.edge_loss, self.loss)
        noisy = depth + self.noise * depth**2 * rng.standard_normal(depth.shape)
        if self.step > 0.0:
            noisy = self.step * np.round(noisy / self.step)
        return np.where(known & ~lost, np.maximum(noisy, 0.0), 0.0).astype(np.float32)


@dataclass(frozen=True)
class StereoSensor:
    """Two cameras side by side, `baseline` metres apart: they measure the disparity f * baseline / d, in pixels.

    Disparity errs by `noise` pixels (standard deviation) at knots that are `patch` pixels apart. Between them the error
    is interpolated, which leaves two thirds of it over an image. Disparity comes in whole `step`s. What the right
    camera cannot see behind something nearer gets no reading. No network was trained with it.
    """

    baseline: float = 0.05
    noise: float = 0.08
    step: float = 1.0 / 16.0
    patch: int = 5

    def apply(self, frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
        """The frame as this sensor would have seen it; only depth changes, and holes become 0."""
        (h, w), fb = frame.depth.shape, frame.K[0, 0] * self.baseline
        known = np.isfinite(frame.depth) & (frame.depth > 0.0)
        disparity = fb / np.where(known, frame.depth, np.inf)
        # In the right image a pixel lies `disparity` further left, hidden if one from its right lies there or beyond.
        place = np.arange(w) - disparity
        leftmost = np.minimum.accumulate(place[:, ::-1], axis=1)[:, ::-1]
        seen = known & (place < np.hstack([leftmost[:, 1:], np.full((h, 1), np.inf)]))
        coarse = rng.standard_normal((h // self.patch + 2, w // self.patch + 2)).astype(np.float32)
        disparity += self.noise * cv2.resize(coarse, (w, h))
        disparity = np.maximum(self.step * np.round(disparity / self.step), self.step)
        return replace(frame, depth=np.where(seen, fb / disparity, 0.0).astype(np.float32))


def perturbed(
    frame: RGBDFrame, rng: np.random.Generator, metres: float = 0.005, degrees: float = 0.5, sensor=DepthSensor()
) -> RGBDFrame:
    """The frame of a real camera: depth through `sensor`, and a pose that is off by so much in a random direction.

    The camera's place is wrong by `metres`, and its attitude by a rotation of `degrees` about a random axis.
    """
    axis, way = (direction / np.linalg.norm(direction) for direction in rng.standard_normal((2, 3)))
    T = frame.T_base_cam.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(np.radians(degrees) * axis).as_matrix()
    T[:3, 3] += metres * way
    return replace(sensor.apply(frame, rng), T_base_cam=T)
