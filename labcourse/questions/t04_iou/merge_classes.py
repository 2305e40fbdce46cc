"""04_iou.merge_classes: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import MOST_CLASSES, array
from labcourse.questions.t04_iou import COUNTS, counts_of_many_classes
from labgrader.question import Question, wrong


def merge_classes(n, group):
    """Give the confusion matrix that the pixels would have if class c were called group[c], in truth and prediction."""
    merged = np.zeros((group.max() + 1, group.max() + 1), np.int64)
    np.add.at(merged, (group[:, None], group), n)
    return merged


def _counts_and_groups(rng):
    """Draw a matrix of 5 or 6 classes with large mistakes, and 3 groups in any order, one of them of three classes."""
    C = int(rng.choice([5, 6]))
    n = rng.integers(0, 90, (C, C)) + np.diag(rng.integers(50, 400, C))
    return n.astype(np.int64), rng.permutation(3)[rng.permutation([0, 0, 0, 1, 2, 2][:C])].astype(np.int64)


def _many_classes(rng):
    """Draw 255 classes with counts of any size, and about half as many groups."""
    (n,) = counts_of_many_classes(rng)
    return n // MOST_CLASSES, _any_groups(rng, rng.integers(0, int(rng.integers(150, 200)), MOST_CLASSES))


def _all_apart(rng):
    """Draw 255 classes that only change their numbers."""
    return *counts_of_many_classes(rng), rng.permutation(MOST_CLASSES)


def _any_groups(rng, values):
    """Whole numbers as groups 0 .. G - 1, in any order."""
    present, group = np.unique(values, return_inverse=True)
    return rng.permutation(len(present))[group.reshape(values.shape)]


QUESTION = Question(
    reference=merge_classes,
    kinds={
        "n": COUNTS,
        "group": array("C", 0, 254, dtype="int64", form=_any_groups, says=("0 .. G - 1, in any order", "each occurs")),
    },
    inputs=(_counts_and_groups, _many_classes, _all_apart),
    by_hand=(
        (np.array([[5, 1, 0], [0, 3, 2], [0, 4, 6]]), np.array([0, 1, 1])),
        (np.array([[5, 1, 7], [0, 3, 2], [9, 4, 6]]), np.array([1, 0, 1])),  # groups need not be in order
        (np.array([[5, 1, 7], [2, 3, 0], [4, 8, 6]]), np.array([0, 0, 0])),  # everything is one class
        (np.array([[5, 1], [2, 3]]), np.array([1, 0])),
        (np.array([[5]]), np.array([0])),
        (np.array([[10**12, 10**12 - 2], [7, 10**12]]), np.array([0, 0])),  # few groups of many pixels
    ),
    edges=2,
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(
    "Some pixels are lost: an index that occurs twice is written once. What adds them up?",
    of=("cells", "columns", "rows"),
)
def written_once(n, group, of):
    G = group.max() + 1
    merged = np.zeros((G, G), n.dtype)
    if of == "cells":
        merged[group[:, None], group] += n
    elif of == "columns":
        merged[:, group] += old_columns(n, group)
    else:
        merged[group] += old_rows(n, group)
    return merged


@wrong("Your matrix is as large as the last class's group says: that need not be the largest of the groups.")
def last_entry_for_the_largest(n, group):
    return merge_classes(n, group)[: group[-1] + 1, : group[-1] + 1]


@wrong("A group may have three classes or more: you add up its first and its last. What of those between them?")
def two_classes_of_each_group(n, group):
    first = np.unique(group, return_index=True)[1]
    last = len(n) - 1 - np.unique(group[::-1], return_index=True)[1]
    ends = np.isin(np.arange(len(n)), [first, last])
    return merge_classes(np.where(ends[:, None] & ends, n, 0), group)


@wrong("Two classes have become one: where do the pixels go that were confused between them?")
def mistakes_within_a_group_dropped(n, group):
    mistake = (group[:, None] == group) & ~np.eye(len(n), dtype=bool)
    return merge_classes(np.where(mistake, 0, n), group)


@wrong("You merge the rows but not the columns: a prediction has a group, too.")
def rows_alone(n, group):
    merged = np.zeros((group.max() + 1, group.max() + 1), n.dtype)
    np.add.at(merged, group, n)
    return merged


@wrong("Your matrix is G x C: its rows are merged, but its columns are still the old classes.")
def old_columns(n, group):
    return np.stack([n[group == g].sum(axis=0) for g in range(group.max() + 1)])


@wrong("Your matrix still has C rows: an index array selects rows, it does not add those of one group.")
def rows_chosen(n, group):
    return n[np.ix_(group, group)]


@wrong("You use only the diagonal of n: where do the mistakes between two groups go?")
def diagonal_alone(n, group):
    merged = np.zeros((group.max() + 1, group.max() + 1), n.dtype)
    np.add.at(merged, (group, group), np.diagonal(n))
    return merged


@wrong("The result has one row per group, yours one per old class: how many groups are there?")
def as_large_as_before(n, group):
    empty = len(n) - (group.max() + 1)
    return np.pad(merge_classes(n, group), (0, empty))


@wrong("A cell adds up rows and columns: how many columns has the other group, and how many do you take?")
def first_column_of_other_groups(n, group):
    first = [np.flatnonzero(group == g)[0] for g in range(group.max() + 1)]
    own = group[:, None] == group
    return merge_classes(np.where(own | np.isin(np.arange(len(n)), first), n, 0), group)


@wrong("The classes of a group need not be neighbours: 0 and 2 may be one, with 1 between them.")
def runs_of_neighbours(n, group):
    starts = np.unique(group, return_index=True)[1]
    return np.add.reduceat(np.add.reduceat(n, starts, axis=0), starts, axis=1)


@wrong("Every cell is a sum: confusions of one group with another add up, too, not only what is on the diagonal.")
def only_the_diagonal_is_summed(n, group):
    first = [int(np.argmax(group == g)) for g in range(group.max() + 1)]
    out = n[np.ix_(first, first)].copy()
    np.fill_diagonal(out, np.diagonal(merge_classes(n, group)))
    return out


@wrong("An index array selects rows and columns but adds nothing up: what is the sum over the classes of one group?")
def chosen_and_cut(n, group):
    G = group.max() + 1
    return n[np.ix_(group, group)][:G, :G]


@wrong("The classes of a group need not be neighbours: 0 and 2 may be one, with 1 between them.")
def runs_as_they_come(n, group):
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    return np.add.reduceat(np.add.reduceat(n, starts, axis=0), starts, axis=1)


@wrong("You merge the rows but not the columns: a prediction has a group, too.")
def columns_cut_off(n, group):
    merged = np.stack([n[group == g].sum(axis=0) for g in range(group.max() + 1)])
    return merged[:, : len(merged)]


@wrong("Your cells hold the mean of those that become one. These are counts: what is the number of all their pixels?")
def averaged(n, group):
    size = np.bincount(group)
    return merge_classes(n, group) / np.outer(size, size)


@wrong("A truth value holds no count: you tell where pixels are. How many are they?")
def whether_there_are_any(n, group):
    return merge_classes(n, group) > 0


@wrong("The columns are merged and the rows are not: the truth has a group, too.")
def old_rows(n, group):
    return old_columns(n.T, group).T


@wrong("Row g belongs to group g: yours are in the order in which groups first occur.")
def groups_as_they_first_occur(n, group):
    order = np.array(list(dict.fromkeys(group.tolist())))
    return merge_classes(n, group)[np.ix_(order, order)]


@wrong("You take one class of each group and leave out the others: a cell is the sum over all of its group.")
def one_class_of_each_group(n, group):
    first = [int(np.argmax(group == g)) for g in range(group.max() + 1)]
    return n[np.ix_(first, first)]


@wrong("You sort the rows by their group, and not the columns: which columns do you add up then?")
def rows_alone_sorted(n, group):
    order = np.argsort(group, kind="stable")
    start = np.searchsorted(group[order], np.arange(group.max() + 1))
    return np.add.reduceat(np.add.reduceat(n[order], start, axis=0), start, axis=1)


@wrong("You sort the classes and cut: what the classes of one group have in common is a sum.")
def sorted_and_cut(n, group):
    G, order = group.max() + 1, np.argsort(group)
    return n[np.ix_(order, order)][:G, :G]
