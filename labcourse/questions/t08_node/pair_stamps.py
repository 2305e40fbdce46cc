"""08_node.pair_stamps: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import count
from labcourse.questions.t08_node import ascending_stamps
from labgrader.question import Question, holds, wrong


def pair_stamps(a, b, slop):
    """For each stamp of a the number of the stamp of b that is nearest to it, and to which it is; or -1."""
    if len(b) == 0:
        return np.full(len(a), -1)
    apart = np.abs(a[:, None] - b[None, :])
    best = apart.argmin(axis=1)
    each_others = apart.argmin(axis=0)[best] == np.arange(len(a))
    return np.where(each_others & (apart.min(axis=1) <= slop), best, -1)


def _streams(rng):
    """Two jittered streams of a second, in nanoseconds of this century, some frames lost; and stamps far from these.

    Those are, 100 s apart: first ones, which are partners or alone; two equally near ones, of b and of a; some that are
    a nanosecond too far from each other; two that differ little in their lower 32 bits; one that has lost its partner
    to another.
    """
    start = 1_700_000_000_000_000_000 + int(rng.integers(0, 10**9))
    slop = int(rng.integers(12, 22)) * 1_000_000
    a, b = (start + 33_333_333 * np.arange(30) + rng.integers(-9_000_000, 26_000_000, 30) for _ in "ab")
    a = np.sort(a)[rng.random(30) < 0.8]
    b = np.sort(b)[rng.random(30) < 0.7]
    if len(b) > 3 and len(a) > 3:
        b[1] = a[2] + slop  # exactly at the bound counts
    far, apart = start + 10**11 * np.arange(-2, 8), slop // 4
    far[1:] += rng.integers(0, 10**9, 9)
    first = far[0] + apart if rng.random() < 0.5 else far[1]
    a = [far[0], *a, far[3], *(far[4] + [-apart, apart]), *far[5:9], *(far[9] + [0, 2 * apart])]
    b = [first, *b, *(far[3] + [-apart, apart]), far[4], *(far[5:8] + slop + 1), far[8] + 2**32 + 2]
    b += [far[9] + apart + 1, far[9] + 3 * apart + 1]
    return np.sort(a), np.sort(b), slop


_NOW = 1_700_000_000_000_000_000


QUESTION = Question(
    reference=pair_stamps,
    kinds={
        "a": ascending_stamps("A", says="A at least 1"),
        "b": ascending_stamps("B", says="b may be empty", least=0),
        "slop": count(0, says="0 or more"),
    },
    inputs=_streams,
    by_hand=(
        (np.array([0, 33, 66]), np.array([2, 40, 90]), 10),
        (np.array([0, 33, 66]), np.array([30, 60, 100]), 6),
        (np.array([10]), np.array([2, 6, 13, 30]), 8),
        (np.array([10, 50, 60]), np.array([6, 14, 56, 61]), 10),  # 56 is nearest to 50, and 60 to 56
        (np.array([10, 20]), np.array([], int), 5),
        (np.array([0, 33, 66]), np.array([36, 70]), 40),
        (np.array([0, 33, 66]), np.array([0, 34, 66]), 0),  # only what is equal
        (np.array([0, 33, 66]), np.array([36, 70]), 40),  # 0 has lost its partner, and 36 is another's
        (np.array([10, 20, 60]), np.array([15, 61]), 9),  # 15 is as near to 10 as to 20
        (1000 * np.arange(1, 301), 1000 * np.arange(301) + 400, 400),  # as many as no byte counts
        (np.array([_NOW]), np.array([_NOW - 2**32 - 2]), 3),  # four seconds, which 32 bits do not see
        (np.array([_NOW, _NOW + 40]), np.array([_NOW - 70, _NOW - 3, _NOW + 41]), 3),
    ),
    edges=3,
    random_cases=8,
    points=3,
)


@holds("one answer for each stamp of a")
def one_for_each(a, b, slop, j):
    return np.shape(j) == np.shape(a)


@holds("each answer is -1, or the number of a stamp of b (from 0), not a stamp")
def numbers_of_b(a, b, slop, j):
    return all(-1 <= k < len(b) for k in j)


# ---------------------------------------------------------------------------------------------------- wrong answers


FAR = np.iinfo(np.int64).max


def pairs(a, b, slop, distance):
    """For each stamp of a the b of least distance if a is its nearest, too; -1 if it is over slop."""
    if len(b) == 0:
        return np.full(len(a), -1)
    apart = distance(a[:, None], b[None, :])
    best = apart.argmin(axis=1)
    mutual = apart.argmin(axis=0)[best] == np.arange(len(a))
    return np.where(mutual & (apart.min(axis=1) <= slop), best, -1)


@wrong("b may be empty: what is argmin of nothing? And two of a may not share a partner: whose nearest is it?")
def one_partner_for_two_and_some_b(a, b, slop):
    apart = np.abs(a[:, None] - b[None, :])
    return np.where(apart.min(axis=1) <= slop, apart.argmin(axis=1), -1)  # raises if b is empty


@wrong("Two stamps of a have the same partner. Is each of the two stamps in a pair the nearest of the other?")
def one_partner_for_two(a, b, slop):
    return np.concatenate([pair_stamps(alone, b, slop) for alone in a[:, None]])


@wrong(
    "You give a stamp of b to the first stamp of a that asks, though a later one is nearer: which is nearest to it?",
    next_best=(True, False),
)
def first_come_first_served(a, b, slop, next_best):
    j, free = np.full(len(a), -1), np.ones(len(b), bool)
    for i in range(len(a)):
        apart = np.where(free | (not next_best), np.abs(b - a[i]), FAR)
        if free.any() and apart.min() <= slop and free[apart.argmin()]:
            j[i] = apart.argmin()
            free[j[i]] = False
    return j


@wrong("A frame whose partner was lost must remain alone: what is slop for?")
def no_bound(a, b, slop):
    return pairs(a, b, FAR, lambda x, y: np.abs(x - y))


@wrong("Depth may be stamped a little later than colour as well as a little earlier.")
def never_later(a, b, slop):
    return pairs(a, b, slop, lambda x, y: np.where(y <= x, x - y, FAR))


@wrong("Depth may be stamped a little earlier than colour as well as a little later.")
def never_earlier(a, b, slop):
    return pairs(a, b, slop, lambda x, y: np.where(y >= x, y - x, FAR))


@wrong("Where all stamps of b are too far, argmin still returns a number, 0: what should the answer be?")
def far_ones_left_in_argmin(a, b, slop):
    return pairs(a, b, FAR, lambda x, y: np.where(np.abs(x - y) <= slop, np.abs(x - y), FAR))


@wrong("Your partner lies far in the future: -900 is smaller than 3, but is it nearer to 0?")
def signed_difference(a, b, slop):
    return pairs(a, b, slop, lambda x, y: x - y)


@wrong("Several stamps may lie within slop; take the nearest of them, not the first.")
def first_within(a, b, slop):
    return pairs(a, b, 0, lambda x, y: np.where(np.abs(x - y) <= slop, 0, 1))


@wrong("Two stamps can be equally near. Then the first of them counts as the nearest: which does yours take?")
def last_of_the_nearest(a, b, slop):
    last = len(b) - 1 - pair_stamps(a[::-1], b[::-1], slop)[::-1]
    return np.where(last == len(b), -1, last)


@wrong("Of stamps that are equally near only the first is the nearest: how many pairs do you make of them?")
def all_of_the_nearest(a, b, slop):
    j = np.full(len(a), -1)
    for i, k in np.ndindex(len(a), len(b)):
        apart = abs(a[i] - b[k])
        if apart <= slop and apart == np.abs(a - b[k]).min() == np.abs(b - a[i]).min():
            j[i] = k
    return j


@wrong("One lost message shifts all pairs after it: compare stamps, not positions.")
def in_order_of_arrival(a, b, slop):
    near = np.abs(a[: len(b)] - b[: len(a)]) <= slop
    return np.append(np.where(near, np.arange(len(near)), -1), np.full(len(a) - len(near), -1))


@wrong("Nanoseconds since 1970 have 19 digits; float32 keeps 7. Subtract before you round anything.")
def stamps_in_float32(a, b, slop):
    a, b = (np.asarray(stamps, np.float32) for stamps in (a, b))
    return pairs(a, b, slop, lambda x, y: np.abs(x - y))


TOO_FEW_DIGITS = "A stamp has 19 digits, and a float keeps 16 of them. What can be subtracted before it is converted?"


@wrong(TOO_FEW_DIGITS)
def stamps_in_float64(a, b, slop):
    return pairs(a.astype(float), b.astype(float), slop, lambda x, y: np.abs(x - y))


@wrong(TOO_FEW_DIGITS)
def stamps_in_seconds(a, b, slop):
    return pairs(a / 1e9, b / 1e9, slop / 1e9, lambda x, y: np.abs(x - y))


@wrong("32 bits end at 2,147,483,647: how large is a stamp?")
def stamps_in_32_bits(a, b, slop):
    return pairs(a.astype(np.int32), b.astype(np.int32), slop, lambda x, y: np.abs(x - y))


@wrong("A stamp whose nearest one belongs to another remains alone: do you give it the next best?")
def next_best(a, b, slop):
    """The nearest pair of all first, then the nearest of what is left."""
    j, free = np.full(len(a), -1), np.ones(len(b), bool)
    for apart, i, k in sorted((abs(int(s) - int(t)), i, k) for i, s in enumerate(a) for k, t in enumerate(b)):
        if apart <= slop and j[i] < 0 and free[k]:
            j[i], free[k] = k, False
    return j


@wrong("0 is the index of b's first stamp: how does Python read it after `if` or `and`?")
def first_one_taken_for_none(a, b, slop):
    j = pair_stamps(a, b, slop)
    return np.where(j == 0, -1, j)
