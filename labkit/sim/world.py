"""A scene in PyBullet: load a SceneSpec, let it settle, step it, render it, and ask where things really are (topic 07).

The base frame is the world frame; metres, seconds.
"""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from labkit.frame import RGBDFrame
from labkit.geometry.sensor import StereoSensor
from labkit.geometry.sheet import Sheet
from labkit.labels import BACKGROUND, SURFACE
from labkit.sim.client import Client, pybullet
from labkit.sim.kinematics import HOME, PANDA_URDF
from labkit.sim.shapes import as_file, data_path, object_mesh, part_mesh, parts_as_obj, urdf_path
from labkit.sim.spec import Camera, ObjectSpec, SceneSpec, Texture
from labkit.sim.textures import paint
from labkit.support.validation import require

TIME_STEP = 1.0 / 240.0
FLOOR_BELOW_TABLE = 0.7
ROOM = 6.0  # edge of the square room, metres
SHEET_DOTS, SHEET_EDGE_MM, PAPER = 5, 15, 0.0003  # of the printed sheet: dots per mm, white around it, metres of height
RENDERERS = {"tiny": pybullet.ER_TINY_RENDERER, "egl": pybullet.ER_BULLET_HARDWARE_OPENGL}
MAX_DROP = 0.3  # metres from which an object may fall before it settles


class World:
    """One PyBullet simulation of a SceneSpec, apart from any other in the process; use it as a context manager.

    Objects drop from where the spec puts them and come to rest before the constructor returns. `client` is PyBullet's
    own interface, `bodies` the body number by object name, `robot` the arm's (None without one). `observers` are called
    after every step. Raises ValueError for an object that starts inside the table or with nothing close below it, for a
    URDF that is not there, and for any use after close().

    >>> spec = SceneSpec(objects=(), camera=Camera.looking_at((0.5, 0, 0), 0.9, 0.3, 0.8), robot=False)
    >>> with World(spec) as world:
    ...     world.render((64, 48)).size
    (64, 48)
    """

    def __init__(self, spec: SceneSpec, settle_seconds: float = 2.0):
        self.spec = spec
        self.observers: list[Callable[[World], None]] = []
        self.client = Client()
        try:
            if spec.camera.renderer == "egl":
                self.client.open_egl()
            self.client.setGravity(0.0, 0.0, -9.81)
            self.client.setPhysicsEngineParameter(
                fixedTimeStep=TIME_STEP, numSolverIterations=100, deterministicOverlappingPairs=1
            )
            self._build_room()
            self._check_starts()
            self.robot = self._load_robot() if spec.robot else None
            self.bodies = {thing.name: self._load_object(thing) for thing in spec.objects}
            self._settle(settle_seconds)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "World":
        return self

    def __exit__(self, *_):
        self.close()

    def close(self) -> None:
        """End the simulation and free its memory; harmless when already closed."""
        self.client.close()

    def step(self, n: int = 1) -> None:
        """Simulate n steps of 1/240 s."""
        for _ in range(n):
            self.client.stepSimulation()
            for observer in self.observers:
                observer(self)

    def pose(self, name: str) -> Float[np.ndarray, "4 4"]:
        """The true pose of an object now, T_base_object. Raises ValueError if there is no such object."""
        require("name", name in self.bodies, f"one of {sorted(self.bodies)}", repr(name))
        body = self.bodies[name]
        # PyBullet speaks of the centre of mass; an object's frame is where its mesh is drawn.
        T_base_mass = _pose_matrix(*self.client.getBasePositionAndOrientation(body))
        T_object_mass = _pose_matrix(*self.client.getDynamicsInfo(body, -1)[3:5])
        return T_base_mass @ np.linalg.inv(T_object_mass)

    def centre(self, name: str) -> Float[np.ndarray, "3"]:
        """The middle of an object's bounding box in its own frame, as a point of the base frame now."""
        thing = next((thing for thing in self.spec.objects if thing.name == name), None)
        T_base_object = self.pose(name)
        return T_base_object[:3, :3] @ object_mesh(thing).bounds.mean(axis=0) + T_base_object[:3, 3]

    def poses(self) -> dict[str, np.ndarray]:
        """The true poses of all objects now, by name."""
        return {name: self.pose(name) for name in self.bodies}

    def render(
        self,
        size: tuple[int, int] = (320, 240),
        camera: Camera | None = None,
        shadow: bool | None = None,
        smooth: bool = False,
    ) -> RGBDFrame:
        """Take an RGB-D image of `size` = (width, height), with true labels and instances.

        Depth is what the camera's sensor reads, 0 where it sees nothing. Instances number the objects of the spec from
        1. `camera` and `shadow` default to the spec's; without shadows it takes half the time. smooth: draw the colours
        at twice the size and average them, so that edges are not jagged; depth and labels are the same, and it takes
        five times as long. Raises ValueError for an empty size.
        """
        if smooth:
            large = self.render((2 * size[0], 2 * size[1]), camera, shadow)
            rgb = cv2.resize(large.rgb, tuple(size), interpolation=cv2.INTER_AREA)
            return replace(self.render(size, camera, shadow), rgb=rgb)
        width, height = size
        require("size", min(size) >= 1, "width and height of at least 1", size)
        camera = camera or self.spec.camera
        light = self.spec.light
        shadow = light.shadow if shadow is None else shadow
        with self.client.quiet():
            _, _, rgba, buffer, segmentation = self.client.getCameraImage(
                width,
                height,
                viewMatrix=view_matrix(np.array(camera.T_base_cam)),
                projectionMatrix=self.client.computeProjectionMatrixFOV(
                    np.degrees(camera.fov_y), width / height, camera.near, camera.far
                ),
                lightDirection=light.direction,
                lightColor=light.colour,
                lightDistance=light.distance,
                shadow=int(shadow),
                lightAmbientCoeff=light.ambient,
                lightDiffuseCoeff=light.diffuse,
                lightSpecularCoeff=light.specular,
                renderer=RENDERERS[camera.renderer],
            )
        buffer = np.asarray(buffer, dtype=np.float64).reshape(height, width)
        bodies = np.asarray(segmentation).reshape(height, width)
        labels, instances = self._label(bodies)
        frame = RGBDFrame(
            rgb=np.ascontiguousarray(np.asarray(rgba, dtype=np.uint8).reshape(height, width, 4)[:, :, :3]),
            depth=np.where(bodies < 0, 0.0, metres(buffer, camera.near, camera.far)).astype(np.float32),
            K=intrinsics(camera.fov_y, width, height, camera.renderer),
            T_base_cam=np.array(camera.T_base_cam),
            labels=labels,
            instances=instances,
            table_z=self.spec.table.z,
        )
        if camera.sensor == "stereo":
            frame = StereoSensor().apply(frame, np.random.default_rng([self.spec.seed, 3]))
        return frame

    def _label(self, bodies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Turn the renderer's body numbers (-1 for nothing) into labels and instances."""
        label_of = np.full(self.client.getNumBodies() + 1, BACKGROUND, dtype=np.uint8)
        instance_of = np.zeros(len(label_of), dtype=np.uint16)
        label_of[self.surfaces] = SURFACE
        for number, thing in enumerate(self.spec.objects, start=1):
            label_of[self.bodies[thing.name]] = thing.class_id
            instance_of[self.bodies[thing.name]] = number
        return label_of[bodies], instance_of[bodies]

    def _build_room(self) -> None:
        table, spec = self.spec.table, self.spec
        floor = table.z - FLOOR_BELOW_TABLE
        self._box((ROOM, ROOM, 0.1), (0.0, 0.0, floor - 0.05), spec.floor)
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            size = (0.1 if x else ROOM, 0.1 if y else ROOM, 3.0)
            self._box(size, (x * ROOM / 2, y * ROOM / 2, floor + 1.5), spec.walls)
        length, width, thickness = table.size
        centre = (*table.centre, table.z - thickness / 2)
        self.table = self._box((length, width, thickness), centre, table.texture)
        self.surfaces = [self.table]
        for piece in spec.furniture:
            body = self._box(piece.size, piece.centre, piece.texture, piece.yaw, piece.pitch)
            if piece.surface:
                self.surfaces.append(body)
        if spec.sheet is not None:
            self.surfaces.append(self._lay(spec.sheet))
        if spec.robot:
            stand = Texture(colour_a=(0.3, 0.3, 0.32))
            self._box((0.2, 0.2, -floor - 0.001), (0.0, 0.0, floor / 2), stand)

    def _box(self, size, centre, texture: Texture, yaw: float = 0.0, pitch: float = 0.0) -> int:
        """A fixed box with a texture on each side, turned about y and then about the vertical."""
        half = [length / 2 for length in size]
        (s, c), (s_pitch, c_pitch) = ((np.sin(angle / 2.0), np.cos(angle / 2.0)) for angle in (yaw, pitch))
        body = self.client.createMultiBody(
            0.0,
            self.client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half),
            self.client.createVisualShape(pybullet.GEOM_BOX, halfExtents=half, rgbaColor=(1, 1, 1, 1)),
            centre,
            (-s * s_pitch, c * s_pitch, s * c_pitch, c * c_pitch),
        )
        picture = cv2.imencode(".png", cv2.cvtColor(paint(texture), cv2.COLOR_RGB2BGR))[1].tobytes()
        with as_file(picture, ".png") as path:
            self.client.changeVisualShape(body, -1, textureUniqueId=self.client.loadTexture(path))
        self.client.changeDynamics(body, -1, lateralFriction=1.0, rollingFriction=0.001, spinningFriction=0.001)
        return body

    def _lay(self, sheet) -> int:
        """The printed sheet as a picture on the table, which nothing touches."""
        x, y, yaw = sheet
        (width, height), edge = Sheet().size_mm, SHEET_EDGE_MM
        board = Sheet().board.generateImage((SHEET_DOTS * width, SHEET_DOTS * height))
        page = cv2.copyMakeBorder(board, *[SHEET_DOTS * edge] * 4, cv2.BORDER_CONSTANT, value=255)
        left, right, top = -1e-3 * edge, 1e-3 * (width + edge), 1e-3 * (height + edge)
        corners = ((left, left), (right, left), (right, top), (left, top))
        lines = [f"v {a} {b} 0" for a, b in corners] + ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "vn 0 0 1"]
        quad = "\n".join([*lines, "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1", ""]).encode()
        place = (x, y, self.spec.table.z + PAPER), (0.0, 0.0, np.sin(yaw / 2.0), np.cos(yaw / 2.0))
        with as_file(quad, ".obj") as path:
            body = self.client.createMultiBody(
                0.0, -1, self.client.createVisualShape(pybullet.GEOM_MESH, fileName=path), *place
            )
        with as_file(cv2.imencode(".png", page)[1].tobytes(), ".png") as path:
            self.client.changeVisualShape(body, -1, textureUniqueId=self.client.loadTexture(path))
        return body

    def _load_robot(self) -> int:
        robot = self.client.loadURDF(str(data_path() / PANDA_URDF), useFixedBase=True)
        moving = [j for j in range(self.client.getNumJoints(robot)) if self.client.getJointInfo(robot, j)[2] != 4]
        for joint, angle in zip(moving, self.spec.joints or HOME, strict=True):
            self.client.resetJointState(robot, joint, angle)
            force = self.client.getJointInfo(robot, joint)[10]
            self.client.setJointMotorControl2(robot, joint, pybullet.POSITION_CONTROL, angle, force=force)
        return robot

    def _check_starts(self) -> None:
        """Raise unless every object starts on or a little above the table or another object."""
        bounds = {thing.name: _bounds(thing) for thing in self.spec.objects}
        for thing in self.spec.objects:
            low, high = bounds.pop(thing.name)
            below = [self.spec.table.z] + [
                top[2]
                for bottom, top in bounds.values()
                if (bottom[:2] < high[:2]).all() and (low[:2] < top[:2]).all() and top[2] <= low[2]
            ]
            bounds[thing.name] = low, high
            drop = low[2] - max(below)
            if not -0.001 <= drop <= MAX_DROP:
                where = f"{-drop:.3g} m deep in the table" if drop < 0.0 else f"{drop:.3g} m above what is below it"
                raise ValueError(
                    f"objects: expected {thing.name!r} to start on the table or at most {MAX_DROP} m above something, "
                    f"got position {thing.position}: its lowest point is {where}"
                )

    def _load_object(self, thing: ObjectSpec) -> int:
        if thing.urdf is not None:
            body = self.client.loadURDF(str(urdf_path(thing.urdf)), globalScaling=thing.scale)
            self._place(body, thing)
        else:
            body = self._load_parts(thing)
        self.client.changeVisualShape(body, -1, textureUniqueId=-1, rgbaColor=(*thing.colour, 1.0))
        self.client.changeDynamics(
            body,
            -1,
            mass=thing.mass,
            lateralFriction=thing.friction,
            rollingFriction=0.001,
            spinningFriction=0.001,
            restitution=0.0,
        )
        return body

    def _place(self, body: int, thing: ObjectSpec) -> None:
        T_base_object = _pose_matrix(thing.position, thing.orientation)
        T_base_mass = T_base_object @ _pose_matrix(*self.client.getDynamicsInfo(body, -1)[3:5])
        quaternion = Rotation.from_matrix(T_base_mass[:3, :3]).as_quat()
        self.client.resetBasePositionAndOrientation(body, T_base_mass[:3, 3], quaternion)

    def _load_parts(self, thing: ObjectSpec) -> int:
        solids = [_volume_and_centroid(part_mesh(part)) for part in thing.parts]
        total = sum(volume for volume, _ in solids)
        mass_centre = thing.scale * sum(volume * centroid for volume, centroid in solids) / total
        # createMultiBody takes the pose of the object's frame, and the centre of mass in that frame.
        with as_file(parts_as_obj(thing.parts, thing.scale), ".obj") as path:
            return self.client.createMultiBody(
                thing.mass,
                self.client.createCollisionShape(pybullet.GEOM_MESH, fileName=path),
                self.client.createVisualShape(pybullet.GEOM_MESH, fileName=path),
                thing.position,
                thing.orientation,
                baseInertialFramePosition=mass_centre,
            )

    def _settle(self, seconds: float) -> None:
        """Step until everything rests, at most `seconds`; observers are not called."""
        for step in range(round(seconds / TIME_STEP)):
            self.client.stepSimulation()
            if step % 24 == 23 and all(self._rests(body) for body in self.bodies.values()):
                break

    def _rests(self, body: int) -> bool:
        linear, angular = self.client.getBaseVelocity(body)
        return bool(np.dot(linear, linear) < 0.002**2 and np.dot(angular, angular) < 0.05**2)


def intrinsics(fov_y: float, width: int, height: int, renderer: str = "tiny") -> Float[np.ndarray, "3 3"]:
    """K of PyBullet's renderers for a vertical field of view in radians; pixel centres at integers.

    The principal point is measured, not assumed: only cx = W / 2, cy = H / 2 - 1 puts a plane that TinyRenderer drew on
    a plane, and only (W - 1) / 2, (H - 1) / 2 one that EGL drew.

    >>> intrinsics(np.pi / 2, 320, 240)
    array([[120.,   0., 160.],
           [  0., 120., 119.],
           [  0.,   0.,   1.]])
    """
    f = height / (2.0 * np.tan(fov_y / 2.0))
    cx, cy = (width / 2.0, height / 2.0 - 1.0) if renderer == "tiny" else ((width - 1) / 2.0, (height - 1) / 2.0)
    return np.array([[f, 0.0, cx], [0.0, f, cy], [0.0, 0.0, 1.0]])


def view_matrix(T_base_cam: Float[np.ndarray, "4 4"]) -> list[float]:
    """OpenGL's view matrix, column by column: it maps base coordinates to a camera that looks along -z with y up."""
    T_gl_cam = np.diag([1.0, -1.0, -1.0, 1.0])
    return (T_gl_cam @ np.linalg.inv(T_base_cam)).T.ravel().tolist()


def metres(buffer: Float[np.ndarray, "H W"], near: float, far: float) -> Float[np.ndarray, "H W"]:
    """Turn the depth buffer, 0 at the near plane and 1 at the far one, into metres along the camera's z axis.

    >>> metres(np.array([[0.0, 1.0]]), 0.1, 6.0)
    array([[0.1, 6. ]])
    """
    return far * near / (far - (far - near) * buffer)


def _pose_matrix(position, quaternion) -> Float[np.ndarray, "4 4"]:
    """A pose as a matrix; SciPy's RigidTransform differs in the last bit, and scenes would settle to other bytes."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    T[:3, 3] = position
    return T


def _bounds(thing: ObjectSpec) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """The lowest and the highest x, y, z of an object where it starts."""
    vertices = Rotation.from_quat(thing.orientation).apply(object_mesh(thing).vertices)
    return vertices.min(axis=0) + thing.position, vertices.max(axis=0) + thing.position


def _volume_and_centroid(mesh) -> tuple[float, Float[np.ndarray, "3"]]:
    """Volume and centroid of a closed mesh: the sum over tetrahedra from the origin to each triangle.

    Not trimesh's, which differ in the last bit: scenes would settle to other bytes.
    """
    a, b, c = np.asarray(mesh.vertices)[mesh.faces].transpose(1, 0, 2)
    volumes = np.einsum("fi,fi->f", a, np.cross(b, c)) / 6.0
    return volumes.sum(), (volumes[:, None] * (a + b + c) / 4.0).sum(axis=0) / volumes.sum()
