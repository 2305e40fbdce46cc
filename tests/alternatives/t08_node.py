"""Right answers to the questions of 08_node, written in other ways than the references."""

import struct

import numpy as np

from labkit.course.topics.t08_node.pack_cloud import finite
from labkit.course.topics.t08_node.pose_at import neighbours, outside
from labkit.course.topics.t08_node.quaternion import quaternion


def decode_depth__struct(data, height, width, step, is_bigendian):
    row = struct.Struct(f"{'>' if is_bigendian else '<'}{width}H")
    numbers = np.array([row.unpack_from(bytes(data), v * step) for v in range(height)], np.float32)
    numbers[numbers == 0] = np.nan
    return numbers / np.float32(1000)


def decode_depth__torch(data, height, width, step, is_bigendian):
    import torch

    rows = torch.stack([torch.from_numpy(data.copy())[v * step : v * step + 2 * width] for v in range(height)])
    pairs = rows.reshape(height, width, 2).to(torch.float64)
    high, low = (0, 1) if is_bigendian else (1, 0)
    numbers = 256 * pairs[..., high] + pairs[..., low]
    return torch.where(numbers > 0, numbers / 1000, torch.nan)


def decode_depth__loops(data, height, width, step, is_bigendian):
    depth = np.full((height, width), np.nan)
    for v in range(height):
        for u in range(width):
            first, second = int(data[v * step + 2 * u]), int(data[v * step + 2 * u + 1])
            number = 256 * first + second if is_bigendian else first + 256 * second
            if number:
                depth[v, u] = number / 1000.0
    return depth


def decode_depth__strided(data, height, width, step, is_bigendian):
    order = ">" if is_bigendian else "<"
    numbers = np.ndarray((height, width), f"{order}u2", np.ascontiguousarray(data).tobytes(), strides=(step, 2))
    return np.where(numbers != 0, numbers.astype(float), np.nan) / 1e3


def pack_cloud__struct(P):
    data = b"".join(struct.pack("<fff4x", *p) for p in P if np.isfinite(p).all())
    return np.frombuffer(data, np.uint8)


def pack_cloud__torch(P):
    import torch

    cloud = torch.from_numpy(P.copy())
    cloud = cloud[torch.isfinite(cloud).all(dim=1)].to(torch.float32)
    numbers = torch.cat([cloud, torch.zeros(len(cloud), 1)], dim=1)
    return numbers.contiguous().view(torch.uint8).reshape(-1)


def pack_cloud__structured(P):
    points = np.zeros(len(finite(P)), np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("pad", "V4")]))
    for axis, name in enumerate("xyz"):
        points[name] = finite(P)[:, axis]
    return np.frombuffer(points.tobytes(), np.uint8)


def pair_stamps__torch(a, b, slop):
    import torch

    if len(b) == 0:
        return torch.full((len(a),), -1)
    apart = (torch.from_numpy(a.copy())[:, None] - torch.from_numpy(b.copy())[None, :]).abs()
    of_a = (apart == apart.amin(dim=1, keepdim=True)).to(torch.int8).argmax(dim=1)
    of_b = (apart == apart.amin(dim=0, keepdim=True)).to(torch.int8).argmax(dim=0)
    kept = (of_b[of_a] == torch.arange(len(a))) & (apart.amin(dim=1) <= slop)
    return torch.where(kept, of_a, -1)


def pair_stamps__loops(a, b, slop):
    def nearest(stamp, others):
        return min(range(len(others)), key=lambda k: abs(int(stamp) - int(others[k])), default=-1)

    found = []
    for i, stamp in enumerate(a):
        j = nearest(stamp, b)
        mutual = j >= 0 and nearest(b[j], a) == i and abs(int(stamp) - int(b[j])) <= slop
        found.append(j if mutual else -1)
    return np.array(found, int)


def pair_stamps__by_searching(a, b, slop):
    def nearest(of, among):
        after = np.searchsorted(among, of).clip(0, len(among) - 1)
        before = (after - 1).clip(0)
        best = np.where(np.abs(of - among[before]) <= np.abs(among[after] - of), before, after)
        return np.searchsorted(among, among[best])  # the first of equal stamps

    if len(b) == 0:
        return np.full(len(a), -1)
    best = nearest(a, b)
    mutual = nearest(b, a)[best] == np.arange(len(a))
    return np.where(mutual & (np.abs(a - b[best]) <= slop), best, -1)


def pose_at__torch(stamps, positions, quaternions, t):
    import torch

    i, share = neighbours(stamps, t)
    P, Q = torch.from_numpy(positions.copy()), torch.from_numpy(quaternions.copy())
    cosine = torch.dot(Q[i], Q[i + 1])
    angle = torch.arccos(cosine.abs().clamp(max=1.0)).clamp(min=1e-7)
    q = torch.sin((1 - share) * angle) * Q[i] + torch.sin(share * angle) * torch.sign(cosine) * Q[i + 1]
    return outside(stamps, t) or (torch.lerp(P[i], P[i + 1], float(share)), q / torch.sin(angle))


def pose_at__by_a_frame(stamps, positions, quaternions, t):
    """Go round the circle that a and the part of b at right angles to it span."""
    i, share = neighbours(stamps, t)
    a, b = quaternions[i], quaternions[i + 1]
    b = np.sign(a @ b) * b
    beside = b - (a @ b) * a
    length = np.linalg.norm(beside)
    angle = share * np.arctan2(length, a @ b)
    place = [np.interp(float(t - stamps[0]), (stamps - stamps[0]).astype(float), axis) for axis in positions.T]
    turn = np.cos(angle) * a + np.sin(angle) * beside / max(length, 1e-12)
    return outside(stamps, t) or (np.array(place), -turn)


def pose_at__by_an_angle(stamps, positions, quaternions, t):
    """Turn from a by a share of the rotation from a to b, whose axis and angle its quaternion says."""

    def product(p, q):
        v = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3])
        return np.array([*v, p[3] * q[3] - p[:3] @ q[:3]])

    i, share = neighbours(stamps, t)
    a, b = quaternions[i], quaternions[i + 1]
    x = product(b, a * [-1.0, -1.0, -1.0, 1.0])
    x = x if x[3] >= 0.0 else -x
    sine = np.linalg.norm(x[:3])
    half = share * np.arctan2(sine, x[3])
    part = np.array([*(np.sin(half) * x[:3] / max(sine, 1e-12)), np.cos(half)])
    return outside(stamps, t) or (positions[i] + share * (positions[i + 1] - positions[i]), product(part, a))


def quaternion__the_other_of_two(R):
    return -quaternion(R)


def quaternion__torch(R):
    import torch

    return torch.tensor(quaternion(R), dtype=torch.float32)


def quaternion__eigen(R):
    S = np.zeros((4, 4))
    S[:3, :3] = R + R.T - np.trace(R) * np.eye(3)
    S[:3, 3] = S[3, :3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    S[3, 3] = np.trace(R)
    return np.linalg.eigh(S)[1][:, -1].astype(np.float32)


def quaternion__cases(R):
    i = int(np.argmax([*np.diag(R), np.trace(R)]))
    j, k = (i + 1) % 3, (i + 2) % 3
    if i == 3:
        w = 0.5 * np.sqrt(1.0 + np.trace(R))
        return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 4.0 * w**2]) / (4.0 * w)
    q = np.zeros(4)
    q[i] = 0.5 * np.sqrt(1.0 + R[i, i] - R[j, j] - R[k, k])
    q[j], q[k] = (R[i, j] + R[j, i]) / (4.0 * q[i]), (R[i, k] + R[k, i]) / (4.0 * q[i])
    q[3] = (R[k, j] - R[j, k]) / (4.0 * q[i])
    return q
