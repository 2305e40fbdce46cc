"""Trials over many scenes, here or on a cluster, and their table: a CSV file with a row for each trial."""

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from functools import partial
from pathlib import Path

from tqdm.auto import tqdm

from labkit.support.files import write_atomically
from labtrain.executors import executor_for

SIZE = (320, 240)  # of the pictures that studies look at


@dataclass(frozen=True)
class Study:
    """Trials of scenes of the kind `test`, and the table of their rows.

    row: the dataclass of a row, with a field `seed`. of_frame: a SceneSpec and the frame that its camera sees -> rows.
    seeds: of the scenes.
    """

    row: type
    of_frame: Callable[..., list]
    seeds: range

    def of_scene(self, seed: int, **how) -> list:
        """Render a scene once, and run its trials; how: what of_frame takes besides."""
        from data_gen import render, sample_scene

        spec = sample_scene(seed, "test")
        return self.of_frame(spec, render(spec, SIZE), **how)

    def run(self, out, scenes: int | None = None, workers: int = 1, dask=None, progress=True, **how) -> list:
        """Run the trials of so many scenes, the study's own if None, and write them to `out`, as `make_table` does."""
        seeds = self.seeds if scenes is None else range(self.seeds.start, self.seeds.start + scenes)
        return make_table(out, self.row, partial(self.of_scene, **how), seeds, workers, progress, dask)

    def read(self, path) -> list:
        """Read a table. Raises ValueError if its columns are others."""
        return read_rows(path, self.row)


def in_order(function: Callable, items: Iterable, workers: int = 1, dask: str | None = None) -> Iterator:
    """Yield function(item) for each item, in their order; where they run says `executor_for`."""
    with executor_for(workers, dask) as executor:
        yield from map(function, items) if executor is None else executor.map(function, items)


def make_table(
    out,
    kind: type,
    trials_of_scene: Callable[[int], list],
    seeds: Sequence[int],
    workers: int = 1,
    progress=True,
    dask=None,
) -> list:
    """Try every scene and write the rows to `out`, scene by scene in the order of `seeds`; returns them.

    kind: the dataclass of a row, with a field `seed`. trials_of_scene: seed -> its rows. What is finished is kept in
    OUT.unfinished: stopped with Ctrl-C, the same call resumes. Raises ValueError if that file is of other
    scenes.
    """
    unfinished = Path(f"{out}.unfinished")
    done = {}
    for row in read_rows(unfinished, kind) if unfinished.exists() else []:
        done.setdefault(row.seed, []).append(row)
    if not done.keys() <= set(seeds):
        raise ValueError(f"out: {unfinished} is of other scenes; remove it, or ask for those")
    missing = [seed for seed in seeds if seed not in done]
    with tqdm(total=len(seeds), initial=len(done), unit="scene", disable=not progress) as bar:
        for rows in in_order(trials_of_scene, missing, workers, dask):
            done[rows[0].seed] = rows
            write_rows(unfinished, [row for seed in sorted(done) for row in done[seed]])
            bar.update()
    rows = [row for seed in seeds for row in done[seed]]
    write_rows(out, rows)
    unfinished.unlink(missing_ok=True)
    return rows


def write_rows(path, rows: Sequence) -> None:
    """Write dataclasses of one kind as CSV, whole or not at all."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(field.name for field in fields(rows[0]))
    writer.writerows(astuple(row) for row in rows)
    write_atomically(path, text.getvalue().encode())


def read_rows(path, kind: type) -> list:
    """Read what `write_rows` wrote of dataclasses of this kind. Raises ValueError if the columns are others."""
    with open(path, newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    types = {field.name: field.type for field in fields(kind)}
    if not lines or lines[0] != list(types):
        raise ValueError(f"path: expected a CSV file with columns {', '.join(types)} in {path}")
    return [kind(*(of(cell) for of, cell in zip(types.values(), line, strict=True))) for line in lines[1:]]
