"""Layout of templates and rows: each distinct case is a template, and rows that grids share belong to the first
grid."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from sigdb.core import BoolArray, IntArray


def distinct(*columns: ArrayLike) -> tuple[IntArray, IntArray]:
    """Return the number of each row's combination of values, and the row in which each combination appears first.

    Parameters
    ----------
    columns
        (n,) each, numbers without nan.

    Returns
    -------
    codes : ndarray of int, (n,)
        Numbers from 0, in order of first appearance.
    first : ndarray of int, (combinations,)
        Rows of first appearance.

    Examples
    --------
    >>> codes, first = distinct([5, 2, 5, 5], [1.0, 0.0, 1.0, 0.0])
    >>> codes.tolist(), first.tolist()
    ([0, 1, 0, 2], [0, 1, 3])
    """
    codes = np.zeros(len(np.asarray(columns[0])), np.int64)
    for column in columns:
        numbers, values = pd.factorize(np.asarray(column))
        if len(values) > 1:
            codes = pd.factorize(codes * len(values) + numbers)[0]
    before = np.maximum.accumulate(np.concatenate([[-1], codes]))[:-1]
    return codes, np.flatnonzero(codes > before)


def consecutive(start: ArrayLike, count: ArrayLike) -> IntArray:
    """Return the ranges ``start ... start + count - 1``, joined.

    Examples
    --------
    >>> consecutive([5, 0], [2, 3]).tolist()
    [5, 6, 0, 1, 2]
    """
    start, count = np.asarray(start, np.int64), np.asarray(count, np.int64)
    before = np.cumsum(count) - count
    return np.repeat(start - before, count) + np.arange(int(count.sum()))


@dataclass(frozen=True, kw_only=True)
class RowRuns:
    """Rows in runs: products of teeth, measurements, specimens and noise draws of a template, the last fastest.

    Attributes
    ----------
    template
        (runs,) number of the template.
    tooth_start, tooth_count
        (runs,) where the teeth of the run begin in ``teeth``, and their number.
    measured_start, measured_count
        (runs,) where its measurements begin in ``measured``, and their number.
    draws
        (runs,) number of noise draws of each specimen.
    specimens
        Number of specimens of every run.
    teeth, measured
        Numbers of teeth, and of measurements, which runs share.
    """

    template: NDArray[np.int32]
    tooth_start: NDArray[np.int32]
    tooth_count: NDArray[np.int32]
    measured_start: NDArray[np.int32]
    measured_count: NDArray[np.int32]
    draws: IntArray
    specimens: int
    teeth: IntArray
    measured: NDArray[np.int32]

    @cached_property
    def first(self) -> IntArray:
        """(runs + 1,) first row of each run, and the number of rows at the end."""
        each = self.tooth_count.astype(np.int64) * self.measured_count * self.specimens * self.draws
        return np.concatenate([np.zeros(1, np.int64), np.cumsum(each)])

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.first[-1])

    def locate(self, rows: IntArray) -> dict[str, IntArray]:
        """Return template, tooth, measurement, specimen and draw of rows."""
        run = np.searchsorted(self.first, rows, side="right") - 1
        within, draw = np.divmod(rows - self.first[run], self.draws[run])
        within, specimen = np.divmod(within, self.specimens)
        tooth, measured = np.divmod(within, self.measured_count[run])
        return {
            "template": self.template[run].astype(np.int64),
            "tooth": self.teeth[self.tooth_start[run] + tooth],
            "measured": self.measured[self.measured_start[run] + measured].astype(np.int64),
            "specimen": specimen,
            "draw": draw,
        }


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """Cases of grids, each with its teeth and its measurements.

    Attributes
    ----------
    grid, rig, damage
        (cases,) numbers of the grid, the rig and the damage.
    tooth_start, tooth_count, measured_start, measured_count
        (cases,) where teeth and measurements begin in their lists, and their numbers.
    """

    grid: IntArray
    rig: IntArray
    damage: IntArray
    tooth_start: IntArray
    tooth_count: IntArray
    measured_start: IntArray
    measured_count: IntArray

    def __len__(self) -> int:
        return len(self.rig)

    def at(self, rows: IntArray | BoolArray) -> "Blocks":
        """Return some blocks, in that order, or repeated."""
        return Blocks(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def tooth_by_tooth(self) -> "Blocks":
        """Return the same blocks with a case for each tooth."""
        each = self.at(np.repeat(np.arange(len(self)), self.tooth_count))
        start = consecutive(self.tooth_start, self.tooth_count)
        return Blocks(**vars(each) | {"tooth_start": start, "tooth_count": np.ones_like(start)})


@dataclass(frozen=True, kw_only=True)
class TemplateTable:
    """Templates by number, ordered by rig; the undamaged template of each rig is the first.

    Attributes
    ----------
    rig
        (templates,) number of the rig.
    damage
        (templates,) number of the damage; -1 for none.
    tooth
        (templates,) first damaged tooth; 0 for none.
    """

    rig: IntArray
    damage: IntArray
    tooth: IntArray

    def __len__(self) -> int:
        return len(self.rig)


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Templates and rows of a plan.

    Attributes
    ----------
    templates
        The distinct cases.
    row_runs
        The rows.
    """

    templates: TemplateTable
    row_runs: RowRuns


def lay_out(
    blocks: Blocks,
    teeth: IntArray,
    measured: IntArray,
    *,
    healthy: tuple[IntArray, IntArray],
    rigs: int,
    turns: bool,
    specimens: int,
    draws: int,
    healthy_draws: int,
) -> Layout:
    """Return the templates, and the rows in runs, of the cases of grids.

    Parameters
    ----------
    blocks
        The cases, grid by grid.
    teeth, measured
        Lists of teeth and of measurements; the first teeth are 0, 1, 2 ... up to the greatest tooth count.
    healthy
        Numbers of rig and measurement of undamaged rows, each combination once.
    rigs
        Number of rigs.
    turns
        Whether other teeth are turns of tooth 1, so that the damage of a template is at tooth 1.
    specimens, draws, healthy_draws
        Number of specimens, and of noise draws of a specimen with damage and without.
    """
    blocks = blocks if turns else blocks.tooth_by_tooth()
    tooth = np.ones(len(blocks), np.int64) if turns else teeth[blocks.tooth_start]
    case, first = distinct(blocks.rig, blocks.damage, tooth)
    order = np.argsort(blocks.rig[first], kind="stable")
    number = np.empty(len(order), np.int64)
    # An undamaged template stands before the cases of its rig.
    number[order] = np.arange(len(order)) + blocks.rig[first][order] + 1
    undamaged = np.arange(rigs) + np.searchsorted(blocks.rig[first][order], np.arange(rigs))
    templates = TemplateTable(
        rig=_merge(undamaged, number, np.arange(rigs), blocks.rig[first]),
        damage=_merge(undamaged, number, np.full(rigs, -1), blocks.damage[first]),
        tooth=_merge(undamaged, number, np.zeros(rigs, np.int64), tooth[first]),
    )
    kept, case, measured = _drop_repeated(blocks, case, teeth, measured)
    of_rig, start, count = _runs(healthy[0] if healthy_draws else np.empty(0, np.int64))
    row_runs = RowRuns(
        template=_join(undamaged[of_rig], number[case]),
        tooth_start=_join(np.zeros_like(of_rig), kept.tooth_start),
        tooth_count=_join(np.ones_like(of_rig), kept.tooth_count),
        measured_start=_join(start + len(measured), kept.measured_start),
        measured_count=_join(count, kept.measured_count),
        draws=np.repeat([healthy_draws, draws], [len(of_rig), len(kept)]),
        specimens=specimens,
        teeth=teeth,
        measured=_join(measured, healthy[1]),
    )
    return Layout(templates=templates, row_runs=row_runs)


def _join(healthy: IntArray, damaged: IntArray) -> NDArray[np.int32]:
    """Return the numbers of teeth and of measurements as int32, to save memory."""
    return np.concatenate([healthy, damaged]).astype(np.int32)


def _merge(undamaged: IntArray, damaged: IntArray, *values: IntArray) -> IntArray:
    whole = np.empty(len(undamaged) + len(damaged), np.int64)
    whole[undamaged], whole[damaged] = values
    return whole


def _runs(values: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return value, start and length of each run of equal values."""
    start = np.flatnonzero(np.diff(values, prepend=-1))
    return values[start], start, np.diff(np.append(start, len(values)))


def _drop_repeated(
    blocks: Blocks, case: IntArray, teeth: IntArray, measured: IntArray
) -> tuple[Blocks, IntArray, IntArray]:
    """Return blocks without the rows of earlier blocks, the case of each, and the list of their measurements.

    Blocks that share a template are split into a block for each tooth. Other blocks stay as they are.
    """
    several = np.bincount(case, minlength=1)[case] > 1
    if not several.any():
        return blocks, case, measured
    at = np.flatnonzero(several)
    by_tooth = np.repeat(at, blocks.tooth_count[at])
    tooth = teeth[consecutive(blocks.tooth_start[at], blocks.tooth_count[at])]
    block = np.repeat(by_tooth, blocks.measured_count[by_tooth])
    tooth = np.repeat(tooth, blocks.measured_count[by_tooth])
    measurement = measured[consecutive(blocks.measured_start[by_tooth], blocks.measured_count[by_tooth])]
    _, first = distinct(case[block], tooth, measurement)
    block, tooth, measurement = block[first], tooth[first], measurement[first]
    group, starts = distinct(blocks.grid[block], case[block])
    of_tooth, _ = distinct(group, tooth)
    order = np.lexsort((of_tooth, group))
    _, begin, count = _runs(of_tooth[order])
    cell = order[begin]
    split = Blocks(
        **vars(blocks.at(block[cell]))
        | {
            "tooth_start": tooth[cell],
            "tooth_count": np.ones_like(cell),
            "measured_start": begin + len(measured),
            "measured_count": count,
        }
    )
    place = np.concatenate([np.flatnonzero(~several), block[starts][group[cell]]])
    alone = blocks.at(~several)
    whole = Blocks(**{name: np.concatenate([value, getattr(split, name)]) for name, value in vars(alone).items()})
    order_of = np.argsort(place, kind="stable")
    cases = np.concatenate([case[~several], case[block[cell]]])
    return whole.at(order_of), cases[order_of], np.concatenate([measured, measurement[order]])
