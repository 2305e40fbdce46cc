"""Paper questions on cameras and frames (topic 06)."""

import numpy as np

from labcourse.exam.paper import Paper, again, names, question
from labcourse.questions.t06_back_projection.cropped_intrinsics import cropped_intrinsics
from labcourse.questions.t06_back_projection.pose_from_homography import pose_from_homography
from labkit.geometry.projection import back_project, back_projection_noise, invert_transform, project, transform_points

FOCAL = (200, 250, 400, 500, 600, 800, 1000)
TURNS = np.array(
    [
        [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
        [[0, 0, 1], [-1, 0, 0], [0, -1, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[0, 0, -1], [1, 0, 0], [0, -1, 0]],
        [[0, -1, 0], [0, 0, -1], [1, 0, 0]],
    ]
)  # none is its own transpose, so who forgets to transpose gets another one


def camera(rng):
    """Draw fx, fy, cx and cy, all different, and the matrix K."""
    (fx, fy), cx, cy = (
        rng.choice(FOCAL, 2, replace=False),
        int(rng.integers(30, 45) * 10),
        int(rng.integers(20, 30) * 10),
    )
    return int(fx), int(fy), cx, cy, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def in_words(fx, fy, cx, cy) -> str:
    """The four intrinsics, as a question gives them."""
    return f"f<sub>x</sub> = {fx}, f<sub>y</sub> = {fy}, c<sub>x</sub> = {cx}, c<sub>y</sub> = {cy}"


def pose(rng):
    """Draw a rotation by quarter turns, of its numbers no two alike, and a position."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = TURNS[rng.integers(len(TURNS))], rng.choice(np.arange(1, 16), 3, replace=False) / 10
    return T


@question(points=3, minutes=4)
def one_point(rng):
    """Back-project a pixel."""
    fx, fy, cx, cy, K = camera(rng)
    d = int(rng.integers(4, 25)) / 10
    du, dv = (int(n) * 10 for n in rng.choice(np.r_[-19:0, 1:20], 2, replace=False))
    P = back_project(np.full((cy + 200, cx + 200), d, np.float32), K)[cy + dv, cx + du].astype(float).round(6)
    again(not np.allclose(P * 100, np.round(P * 100)))
    return Paper(
        {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "d": d, "u": cx + du, "v": cy + dv},
        f"<p>A camera has {in_words(fx, fy, cx, cy)}, in pixels. The pixel in column u = {cx + du} of row v = "
        f"{cy + dv} has the "
        f"depth d = {d:g} m. Where is its point in the camera's frame (x right, y down, z forward)?</p>",
        {"P_cam": P},
        f"x = (u − c<sub>x</sub>) d / f<sub>x</sub> = {du} · {d:g} / {fx}".replace("-", "−") + ", y alike, z = d.",
        {"took u for the row": [(cy + dv - cx) * d / fx, (cx + du - cy) * d / fy, d]},
    )


@question(points=3, minutes=4)
def to_pixel(rng):
    """Project a point."""
    fx, fy, cx, cy, K = camera(rng)
    P = np.append(rng.choice(np.r_[-30:0, 1:31], 2, replace=False) / 100, int(rng.choice([4, 5, 8, 10, 16, 20])) / 10)
    u, v = (float(x) for x in project(P, K))
    again(not np.allclose([u, v], np.round([u, v])))
    return Paper(
        {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "P": P},
        f"<p>A camera has {in_words(fx, fy, cx, cy)}. At which pixel (column u, row v) does it see the point "
        f"({', '.join(f'{x:g}' for x in P)}) of its own frame, in metres?</p>".replace("-", "−"),
        {"u": round(u, 9), "v": round(v, 9)},
        "u = f<sub>x</sub> x / z + c<sub>x</sub>, v = f<sub>y</sub> y / z + c<sub>y</sub>.",
        {"did not divide by z": fx * P[0] + cx, "left the principal point out": fx * P[0] / P[2]},
    )


@question(points=3, minutes=4)
def to_base(rng):
    """Carry a point from the camera's frame to the base's."""
    T, P = pose(rng), rng.choice(np.r_[-9:0, 1:10], 3, replace=False) / 10
    P[2] = abs(P[2])
    there = transform_points(T, P)
    return Paper(
        {"t": T[:3, 3], "P": P},
        f"<p>T<sub>base,cam</sub> is</p>{names(T)}<p>Where is the point P<sub>cam</sub> = "
        f"({', '.join(f'{x:g}' for x in P)}) in the "
        "base frame? And where is the camera?</p>".replace("-", "−"),
        {"P_base": there, "camera": T[:3, 3]},
        "R P + t; the camera is where (0, 0, 0) lands, at t.",
        {"took the matrix for its inverse": transform_points(invert_transform(T), P), "left t out": there - T[:3, 3]},
    )


@question(points=3, minutes=5)
def inverse(rng):
    """Invert a rigid transform."""
    T = pose(rng)
    inverted = invert_transform(T)
    return Paper(
        {"t": T[:3, 3]},
        f"<p>T<sub>base,cam</sub> is</p>{names(T)}<p>Write T<sub>cam,base</sub>. In the camera's frame, where is the "
        "base's origin?</p>",
        {"origin": inverted[:3, 3], "R": inverted[:3, :3].astype(int)},
        "The upper left of T is Rᵀ, since a rotation's inverse is its transpose; its last column is the origin, −Rᵀ t.",
        {
            "turned the sign of t alone": -T[:3, 3],
            "forgot to transpose": -T[:3, :3] @ T[:3, 3],
            "left R as it is": {"R": T[:3, :3].astype(int)},
        },
    )


@question(points=3, minutes=5)
def cropped(rng):
    """Change the intrinsics with a crop and a resize."""
    fx, fy, cx, cy, K = camera(rng)
    left, top = (int(n) * 10 for n in rng.choice(np.arange(2, 16), 2, replace=False))
    scale = float(rng.choice([0.5, 2.0, 0.25, 4.0]))
    new = cropped_intrinsics(K, left, top, scale)
    return Paper(
        {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "left": left, "top": top, "scale": scale},
        f"<p>A camera has {in_words(fx, fy, cx, cy)}; the centre of the first pixel is at u = v = 0. The image is "
        f"cropped by {left} "
        f"columns at the left and {top} rows at the top, and then resized by {scale:g}. Give f<sub>x</sub> and "
        "c<sub>x</sub> of the "
        "new image, where the centre of its first pixel is again at 0.</p>",
        {"cx": new[0, 2], "fx": new[0, 0]},
        f"f scales. ({cx} − {left} + 1/2) · {scale:g} − 1/2: pixels' edges scale, and centres lie half a pixel from "
        "them.",
        {"left the half pixel out": scale * (cx - left), "forgot the crop": scale * (cx + 0.5) - 0.5},
    )


@question(points=4, minutes=6)
def height_error(rng):
    """Carry errors of the row and of the depth to a height."""
    fy, d, dv = (
        int(rng.choice(FOCAL)),
        int(rng.choice([5, 8, 10, 12, 15, 16, 20, 24])) / 10,
        int(rng.integers(2, 19)) * 10,
    )
    pixel, depth = float(rng.choice([0.5, 1, 1.5, 2, 3, 4, 6])), int(rng.integers(2, 31))
    K = np.array([[600.0, 0, 320], [0, fy, 240], [0, 0, 1]])
    height = 1000 * np.sqrt(back_projection_noise(320, 240 + dv, d, K, pixel, depth / 1000)[1, 1])
    parts = 1000 * d / fy * pixel, dv / fy * depth
    again(
        not np.allclose(np.array([height, *parts]) * 10, np.round(np.array([height, *parts]) * 10)) or min(parts) < 0.1
    )
    return Paper(
        {"fy": fy, "d": d, "dv": dv, "pixel": pixel, "depth": depth},
        f"<p>A camera looks level, so a point's height is that of the camera minus y. f<sub>y</sub> = {fy}. A point "
        f"{dv} rows below "
        f"the principal point has the depth {d:g} m. The row is uncertain by {pixel:g} px (one standard "
        "deviation), the depth "
        f"by {depth} mm, independently. By how many millimetres is the height uncertain?</p>",
        {"mm": round(height, 6)},
        f"By the row: d / f<sub>y</sub> · {pixel:g} = {parts[0]:g} mm; by the depth: {dv}/{fy} · {depth} = "
        f"{parts[1]:g} mm. "
        "Squares add.",
        {"added them": sum(parts), "looked at the row alone": parts[0]},
    )


@question(points=3, minutes=5)
def ray_length(rng):
    """Tell the length of a ray from depth."""
    far, near, side = [(5, 4, 3), (5, 3, 4), (13, 12, 5), (25, 24, 7), (17, 15, 8), (25, 7, 24)][rng.integers(6)]
    f, factor = int(rng.choice([120, 240, 360, 480, 600, 720, 840])), int(rng.integers(1, 6)) / 10
    du, length = side * f / near, far * factor
    again(du > 700 or du != int(du))
    K = np.array([[f, 0, 0], [0, f, 0], [0, 0, 1.0]])
    at_one = back_project(np.ones((1, int(du) + 1), np.float32), K)[0, int(du)].astype(float)
    depth = length / np.linalg.norm(at_one)
    return Paper(
        {"f": f, "du": du, "length": length},
        f"<p>A sensor measures the distance from the camera's centre along each pixel's ray. f = {f} pixels. A pixel "
        f"{du:g} columns "
        f"right of the principal point and in its row reads {length:g} m. What are x and z of its point?</p>",
        {"z": round(depth, 6), "x": round(depth * du / f, 6)},
        f"At z = 1 the ray is {far}/{near} long ({near}, {side}, {far}), so z = {length:g} · {near}/{far}.",
        {"took the length for depth": length},
    )


@question(points=4, minutes=6)
def over_the_sheet(rng):
    """Read a camera's place off a homography."""
    fx, fy, cx, cy, K = camera(rng)
    a, b = [(1, 0), (-1, 0), (0, 1), (0, -1)][rng.integers(4)]
    t = np.append(rng.choice(np.r_[-9:0, 1:10], 2, replace=False) / 10, int(rng.choice([5, 6, 8, 10, 12, 15])) / 10)
    factor = float(rng.choice([2.0, 4.0, 0.5, 5.0]))
    H = -factor * K @ np.column_stack([(a, b, 0.0), (b, -a, 0.0), t])
    place = pose_from_homography(H, K)[:3, 3].round(9)
    return Paper(
        {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "t": t},
        f"<p>A camera has {in_words(fx, fy, cx, cy)}. It looks straight down at a printed sheet, which it sees by the "
        f"homography H: H (x, y, 1) is (u, v, 1) times a number, with x and y in metres.</p>{names(H.round(6) + 0.0)}"
        "<p>Where is the camera in the frame of the sheet, whose z points up?</p>",
        {"camera": place},
        f"K<sup>−1</sup> H = s [r<sub>1</sub> r<sub>2</sub> t], and r<sub>1</sub> has length 1: s = −{factor:g}, "
        "negative since t<sub>z</sub> &gt; 0. The camera is at −Rᵀ t, its first two numbers −r<sub>1</sub>·t and "
        "−r<sub>2</sub>·t.",
        {
            "left the sign of s open": place * (1, 1, -1),
            "gave the place of the sheet in the camera's frame": t,
            "left the factor in t": factor * place,
        },
    )


@question(points=3, minutes=4)
def disparity(rng):
    """Tell a depth, and its error, from two photographs."""
    f, b = int(rng.choice(FOCAL)), int(rng.choice([4, 5, 6, 8, 10, 12, 15, 16, 20])) / 100
    z = int(rng.choice([4, 5, 6, 8, 12, 15, 16, 20, 24])) / 10
    shift, u = f * b / z, int(rng.integers(300, 600))
    mm = 1000 * z**2 / (b * f)
    again(abs(shift - round(shift)) > 1e-9 or abs(1000 * mm - round(1000 * mm)) > 1e-6)
    return Paper(
        {"f": f, "b": b, "u": u, "shift": round(shift)},
        f"<p>Two cameras look the same way, the second {100 * b:g} cm to the right of the first; f = {f} pixels. A "
        f"point is seen in column {u} of the first picture and in column {u - round(shift)} of the second, in one row. "
        "How far away is it (z, in metres)? By how many millimetres is that off, to first order, if one of the columns "
        "is off by a pixel?</p>",
        {"z": round(z, 9), "mm": round(mm, 6)},
        f"z = f b / δ with δ = {round(shift)}; z² / (b f) per pixel.",
        {"took u for the disparity": f * b / u, "forgot the square": {"mm": 1000 * z / (b * f)}},
    )
