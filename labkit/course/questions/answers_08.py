"""Answers to topic 08's questions: wrong ones as students give them, and right ones written in other ways."""

import struct

import numpy as np

# ------------------------------------------------------------------------------------------ depth from bytes


def units(data, height, width, step, order):
    """The numbers of a 16UC1 image in a byte order, the padding left out."""
    rows = np.frombuffer(bytes(data), np.uint8)[: height * step].reshape(height, step)
    return np.frombuffer(rows[:, : 2 * width].tobytes(), f"{order}u2").reshape(height, width)


def metres(numbers):
    return np.where(numbers > 0, numbers * 0.001, np.nan)


def padding_as_pixels(data, height, width, step, is_bigendian):
    numbers = np.frombuffer(data.tobytes(), ">u2" if is_bigendian else "<u2")
    return metres(numbers[: height * width].reshape(height, width))


def always_little(data, height, width, step, is_bigendian):
    return metres(units(data, height, width, step, "<"))


def order_swapped(data, height, width, step, is_bigendian):
    return metres(units(data, height, width, step, "<" if is_bigendian else ">"))


def still_millimetres(data, height, width, step, is_bigendian):
    numbers = units(data, height, width, step, ">" if is_bigendian else "<")
    return np.where(numbers > 0, numbers, np.nan)


def zero_is_a_distance(data, height, width, step, is_bigendian):
    return units(data, height, width, step, ">" if is_bigendian else "<") * 0.001


def signed_numbers(data, height, width, step, is_bigendian):
    return metres(units(data, height, width, step, ">" if is_bigendian else "<").astype(np.int16))


def low_byte_only(data, height, width, step, is_bigendian):
    numbers = units(data, height, width, step, ">" if is_bigendian else "<")
    return metres(numbers % 256)


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


# ------------------------------------------------------------------------------------------ pairs of stamps


def pairs(a, b, slop, distance):
    """For each stamp of a the b of least distance (the earliest of equals), -1 if it is over slop."""
    if len(b) == 0:
        return np.full(len(a), -1)
    apart = distance(a[:, None], b[None, :])
    best = apart.argmin(axis=1)
    return np.where(apart.min(axis=1) <= slop, best, -1)


def no_bound(a, b, slop):
    return pairs(a, b, np.iinfo(np.int64).max, lambda x, y: np.abs(x - y))


def strictly_within(a, b, slop):
    return pairs(a, b, slop - 1, lambda x, y: np.abs(x - y))


def never_later(a, b, slop):
    far = np.iinfo(np.int64).max
    return pairs(a, b, slop, lambda x, y: np.where(y <= x, x - y, far))


def signed_difference(a, b, slop):
    return pairs(a, b, slop, lambda x, y: x - y)


def first_within(a, b, slop):
    return pairs(a, b, 0, lambda x, y: np.where(np.abs(x - y) <= slop, 0, 1))


def in_order_of_arrival(a, b, slop):
    j = np.arange(len(a))
    there = j < len(b)
    near = np.zeros(len(a), bool)
    near[there] = np.abs(a[there] - b[j[there]]) <= slop
    return np.where(near, j, -1)


def stamps_in_float32(a, b, slop):
    a, b = (np.asarray(stamps, np.float32) for stamps in (a, b))
    return pairs(a, b, slop, lambda x, y: np.abs(x - y))


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


# ------------------------------------------------------------------------------------------ error by lag


def place(stamps, positions, when):
    return np.array([np.interp(when, stamps, positions[:, axis]) for axis in range(3)])


def lag_in_metres(stamps, positions, taken, used):
    return np.linalg.norm(place(stamps, positions, used) - place(stamps, positions, taken))


def nearest_sample(stamps, positions, taken, used):
    here, there = (positions[np.abs(stamps - when).argmin()] for when in (taken, used))
    return 1000.0 * np.linalg.norm(there - here)


def mean_speed_times_lag(stamps, positions, taken, used):
    way = np.linalg.norm(positions[-1] - positions[0])
    return 1000.0 * way / (stamps[-1] - stamps[0]) * (used - taken)


def length_of_the_way(stamps, positions, taken, used):
    between = stamps[(stamps > taken) & (stamps < used)]
    way = np.array([place(stamps, positions, when) for when in (taken, *between, used)])
    return 1000.0 * np.linalg.norm(np.diff(way, axis=0), axis=1).sum()


def seen_from_above(stamps, positions, taken, used):
    return 1000.0 * np.linalg.norm((place(stamps, positions, used) - place(stamps, positions, taken))[:2])


def sum_of_axes(stamps, positions, taken, used):
    return 1000.0 * np.abs(place(stamps, positions, used) - place(stamps, positions, taken)).sum()


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


# ------------------------------------------------------------------------------------------ clouds as bytes


def finite(P):
    return P[np.isfinite(P).all(axis=1)]


def packed(P, kind="<f4", padding=4):
    """Rows of x, y, z in a number type, each with padding behind it."""
    rows = np.ascontiguousarray(P, kind).view(np.uint8).reshape(len(P), -1)
    return np.hstack([rows, np.zeros((len(P), padding), np.uint8)])


def holes_kept(P):
    return packed(P).ravel()


def holes_as_origin(P):
    return packed(np.where(np.isfinite(P).all(axis=1, keepdims=True), P, 0.0)).ravel()


def double_precision(P):
    return packed(finite(P), "<f8").ravel()


def big_endian(P):
    return packed(finite(P), ">f4").ravel()


def no_padding(P):
    return packed(finite(P), padding=0).ravel()


def axis_after_axis(P):
    cloud = finite(P)
    numbers = np.column_stack([cloud, np.zeros(len(cloud))])
    return np.frombuffer(numbers.T.astype("<f4").tobytes(), np.uint8)


def padding_first(P):
    return np.roll(packed(finite(P)), 4, axis=1).ravel()


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


# ------------------------------------------------------------------------------------------ quaternions


def from_trace(R):
    """The formula that divides by w: fine only for turns well below half a turn."""
    w = 0.5 * np.sqrt(1.0 + np.trace(R))
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 4.0 * w * w]) / (4.0 * w)


def right_quaternion(R):
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_quat()


def scalar_first(R):
    return np.roll(right_quaternion(R), 1)


def inverse_turn(R):
    return right_quaternion(R.T)


def rotation_vector(R):
    q = right_quaternion(R)
    q = -q if q[3] < 0.0 else q
    angle = 2.0 * np.arccos(min(q[3], 1.0))
    axis = q[:3] / max(np.linalg.norm(q[:3]), 1e-12)
    return np.array([*axis, angle])


def whole_angle(R):
    x, y, z, angle = rotation_vector(R)
    return np.array([*(np.sin(angle) * np.array([x, y, z])), np.cos(angle)])


def doubled(R):
    return 2.0 * right_quaternion(R)


def only_magnitudes(R):
    return np.abs(right_quaternion(R))


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
