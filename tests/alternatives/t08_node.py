"""Right answers to the questions of 08_node, written in other ways than the references."""

import struct

import numpy as np

from labkit.course.questions.t08_node.lag_error import place
from labkit.course.questions.t08_node.pack_cloud import finite
from labkit.course.questions.t08_node.quaternion import from_trace, right_quaternion

# ---------- decode_depth


def depth_loops(data, height, width, step, is_bigendian):
    depth = np.full((height, width), np.nan)
    for v in range(height):
        for u in range(width):
            first, second = int(data[v * step + 2 * u]), int(data[v * step + 2 * u + 1])
            number = 256 * first + second if is_bigendian else first + 256 * second
            if number:
                depth[v, u] = number / 1000.0
    return depth


def depth_struct(data, height, width, step, is_bigendian):
    row = struct.Struct(f"{'>' if is_bigendian else '<'}{width}H")
    numbers = np.array([row.unpack_from(bytes(data), v * step) for v in range(height)], np.float32)
    numbers[numbers == 0] = np.nan
    return numbers / np.float32(1000)


def depth_strided(data, height, width, step, is_bigendian):
    order = ">" if is_bigendian else "<"
    numbers = np.ndarray((height, width), f"{order}u2", np.ascontiguousarray(data).tobytes(), strides=(step, 2))
    return np.where(numbers != 0, numbers.astype(float), np.nan) / 1e3


def depth_torch(data, height, width, step, is_bigendian):
    import torch

    rows = torch.stack([torch.from_numpy(data.copy())[v * step : v * step + 2 * width] for v in range(height)])
    pairs = rows.reshape(height, width, 2).to(torch.float64)
    high, low = (0, 1) if is_bigendian else (1, 0)
    numbers = 256 * pairs[..., high] + pairs[..., low]
    return torch.where(numbers > 0, numbers / 1000, torch.nan)


# ---------- pair_stamps


def pairs_loops(a, b, slop):
    found = []
    for stamp in a:
        best = -1
        for j, other in enumerate(b):
            apart = abs(int(stamp) - int(other))
            if apart <= slop and (best < 0 or apart < abs(int(stamp) - int(b[best]))):
                best = j
        found.append(best)
    return np.array(found, int)


def pairs_sorted(a, b, slop):
    if len(b) == 0:
        return np.full(len(a), -1)
    after = np.searchsorted(b, a).clip(0, len(b) - 1)
    before = (after - 1).clip(0)
    best = np.where(np.abs(a - b[before]) <= np.abs(b[after] - a), before, after)
    best = np.searchsorted(b, b[best])  # the first of equal stamps
    return np.where(np.abs(a - b[best]) <= slop, best, -1)


def pairs_torch(a, b, slop):
    import torch

    if len(b) == 0:
        return torch.full((len(a),), -1)
    apart = (torch.from_numpy(a.copy())[:, None] - torch.from_numpy(b.copy())[None, :]).abs()
    least, best = apart.min(dim=1)
    best = (apart == least[:, None]).to(torch.int8).argmax(dim=1)
    return torch.where(least <= slop, best, -1)


# ---------- lag_error


def lag_loops(stamps, positions, taken, used):
    found = []
    for when in (taken, used):
        when = min(max(when, stamps[0]), stamps[-1])
        i = max(j for j in range(len(stamps) - 1) if stamps[j] <= when)
        share = (when - stamps[i]) / (stamps[i + 1] - stamps[i])
        found.append([(1 - share) * p + share * q for p, q in zip(positions[i], positions[i + 1], strict=True)])
    return 1000.0 * sum((p - q) ** 2 for p, q in zip(*found, strict=True)) ** 0.5


def lag_scipy(stamps, positions, taken, used):
    from scipy.interpolate import interp1d

    ends = (positions[0], positions[-1])
    p, q = interp1d(stamps, positions, axis=0, bounds_error=False, fill_value=ends)([taken, used])
    return 1000.0 * np.sqrt(np.sum((p - q) ** 2))


def lag_float32(stamps, positions, taken, used):
    p, q = (place(stamps, positions, when).astype(np.float32) for when in (used, taken))
    return np.sqrt(np.einsum("i,i->", p - q, p - q)) * np.float32(1000)


# ---------- pack_cloud


def pack_struct(P):
    data = b"".join(struct.pack("<fff4x", *p) for p in P if np.isfinite(p).all())
    return np.frombuffer(data, np.uint8)


def pack_structured(P):
    points = np.zeros(len(finite(P)), np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("pad", "V4")]))
    for axis, name in enumerate("xyz"):
        points[name] = finite(P)[:, axis]
    return np.frombuffer(points.tobytes(), np.uint8)


def pack_columns(P):
    cloud = finite(P)
    numbers = np.zeros((len(cloud), 4), np.float32)
    numbers[:, :3] = cloud
    return numbers.view(np.uint8).reshape(-1)


def pack_torch(P):
    import torch

    cloud = torch.from_numpy(P.copy())
    cloud = cloud[torch.isfinite(cloud).all(dim=1)].to(torch.float32)
    numbers = torch.cat([cloud, torch.zeros(len(cloud), 1)], dim=1)
    return numbers.contiguous().view(torch.uint8).reshape(-1)


# ---------- quaternion


def quaternion_scipy(R):
    return -right_quaternion(R)  # the same rotation


def quaternion_eigen(R):
    S = np.zeros((4, 4))
    S[:3, :3] = R + R.T - np.trace(R) * np.eye(3)
    S[:3, 3] = S[3, :3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    S[3, 3] = np.trace(R)
    return np.linalg.eigh(S)[1][:, -1].astype(np.float32)


def quaternion_cases(R):
    i = int(np.argmax([*np.diag(R), np.trace(R)]))
    if i == 3:
        return from_trace(R)
    j, k = (i + 1) % 3, (i + 2) % 3
    q = np.zeros(4)
    q[i] = 0.5 * np.sqrt(1.0 + R[i, i] - R[j, j] - R[k, k])
    q[j], q[k] = (R[i, j] + R[j, i]) / (4 * q[i]), (R[i, k] + R[k, i]) / (4 * q[i])
    q[3] = (R[k, j] - R[j, k]) / (4 * q[i])
    return q


def quaternion_torch(R):
    import torch

    return torch.tensor(quaternion_cases(R), dtype=torch.float32)


ALTERNATIVES = {
    "decode_depth": (depth_loops, depth_struct, depth_strided, depth_torch),
    "pair_stamps": (pairs_loops, pairs_sorted, pairs_torch),
    "lag_error": (lag_loops, lag_scipy, lag_float32),
    "pack_cloud": (pack_struct, pack_structured, pack_columns, pack_torch),
    "quaternion": (quaternion_scipy, quaternion_eigen, quaternion_cases, quaternion_torch),
}
