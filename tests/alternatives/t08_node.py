"""Right answers to the questions of 08_node, written in other ways than the references."""

import struct

import numpy as np

from labkit.course.topics.t08_node.pose_at import neighbours, outside
from labkit.course.topics.t08_node.quaternion import quaternion


def decode_depth__torch(data, height, width, step, is_bigendian):
    import torch

    rows = torch.stack([torch.from_numpy(data.copy())[v * step : v * step + 2 * width] for v in range(height)])
    pairs = rows.reshape(height, width, 2).to(torch.float64)
    high, low = (0, 1) if is_bigendian else (1, 0)
    numbers = 256 * pairs[..., high] + pairs[..., low]
    return torch.where(numbers > 0, numbers / 1000, torch.nan)


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
