"""Right answers to the questions of 08_node, written in other ways than the references."""

import struct

import numpy as np

from labkit.course.topics.t08_node.pose_at import neighbours, outside
from labkit.course.topics.t08_node.quaternion import right_quaternion


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


def pair_stamps__torch(a, b, slop):
    import torch

    if len(b) == 0:
        return torch.full((len(a),), -1)
    apart = (torch.from_numpy(a.copy())[:, None] - torch.from_numpy(b.copy())[None, :]).abs()
    of_a = (apart == apart.amin(dim=1, keepdim=True)).to(torch.int8).argmax(dim=1)
    of_b = (apart == apart.amin(dim=0, keepdim=True)).to(torch.int8).argmax(dim=0)
    kept = (of_b[of_a] == torch.arange(len(a))) & (apart.amin(dim=1) <= slop)
    return torch.where(kept, of_a, -1)


def pose_at__torch(stamps, positions, quaternions, t):
    import torch

    i, share = neighbours(stamps, t)
    P, Q = torch.from_numpy(positions.copy()), torch.from_numpy(quaternions.copy())
    cosine = torch.dot(Q[i], Q[i + 1])
    angle = torch.arccos(cosine.abs().clamp(max=1.0)).clamp(min=1e-7)
    q = torch.sin((1 - share) * angle) * Q[i] + torch.sin(share * angle) * torch.sign(cosine) * Q[i + 1]
    return outside(stamps, t) or (torch.lerp(P[i], P[i + 1], float(share)), q / torch.sin(angle))


def pack_cloud__struct(P):
    data = b"".join(struct.pack("<fff4x", *p) for p in P if np.isfinite(p).all())
    return np.frombuffer(data, np.uint8)


def pack_cloud__torch(P):
    import torch

    cloud = torch.from_numpy(P.copy())
    cloud = cloud[torch.isfinite(cloud).all(dim=1)].to(torch.float32)
    numbers = torch.cat([cloud, torch.zeros(len(cloud), 1)], dim=1)
    return numbers.contiguous().view(torch.uint8).reshape(-1)


def quaternion__scipy(R):
    return -right_quaternion(R)  # the same rotation


def quaternion__torch(R):
    import torch

    return torch.tensor(right_quaternion(R), dtype=torch.float32)
