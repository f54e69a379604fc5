"""The splits S0 to S4, S6 and S7 of one database, and the model form by which another database is the split S5."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, InputError, suggestion, without_keys
from sigdb.database.splits.names import MEASURED_SPLITS, MEMBER, POINT, QUANTITIES
from sigdb.database.splits.split import ASIDE, TEST, TRAINING, Split, specimen_folds


def between(cells: pd.DataFrame) -> BoolArray:
    """Return whether each cell is held out so that its neighbours on both sides stay.

    A line is a row of cells that differ in one quantity only. A cell is held out where it is second, fourth, ... but
    not last on every line of three or more cells that runs through it, and there is such a line.

    Parameters
    ----------
    cells
        Distinct cells: a column for each quantity of the severity.

    Examples
    --------
    >>> import pandas as pd
    >>> loss = [0.1, 0.2, 0.3, 0.4, 0.5]
    >>> cells = pd.DataFrame({"stiffness_loss": loss, "phase_shift_deg": 0.0, "damaged_teeth": 1})
    >>> between(cells).tolist()
    [False, True, False, True, False]
    """
    on_a_line, off_its_places = np.zeros(len(cells), bool), np.zeros(len(cells), bool)
    for axis in QUANTITIES:
        line = cells.groupby([other for other in QUANTITIES if other != axis])[axis]
        place, length = line.rank().to_numpy(), line.transform("size").to_numpy()
        long = length >= 3
        on_a_line |= long
        off_its_places |= long & ((place % 2 == 1) | (place == length))
    return on_a_line & ~off_its_places


def beyond(cells: pd.DataFrame) -> BoolArray:
    """Return whether each cell has the greatest magnitude of a quantity that has three magnitudes or more.

    Examples
    --------
    >>> import pandas as pd
    >>> cells = pd.DataFrame({"stiffness_loss": [0.2, 0.3, 0.4], "phase_shift_deg": 0.0, "damaged_teeth": 1})
    >>> beyond(cells).tolist()
    [False, False, True]
    """
    outermost = np.zeros(len(cells), bool)
    for axis in QUANTITIES:
        magnitude = cells[axis].abs()
        if magnitude.nunique() >= 3:
            outermost |= (magnitude == magnitude.max()).to_numpy()
    return outermost


@dataclass(frozen=True, kw_only=True)
class Folds:
    """How specimens are dealt: the seed of the database, the number of folds, and the fold that is held out."""

    seed: int
    number: int
    held_out: int = 0


def make_split(
    name: str, rows: pd.DataFrame, *, seed: int, folds: int, held_out: int = 0, allow_leak: bool = False
) -> Split:
    """Return a split of a database's rows.

    ======  ===========================================================================================
    name    test rows
    ======  ===========================================================================================
    ``S0``  new noise only: other draws of the same specimens and cases; a sanity check
    ``S1``  other specimens, the same cases
    ``S2``  other specimens, severities between those of training (:func:`~sigdb.database.splits.kinds.between`)
    ``S3``  other specimens, severities beyond those of training (:func:`~sigdb.database.splits.kinds.beyond`)
    ``S4``  other specimens, a tooth count that training has not seen: the middle one, the greater of two
    ``S6``  other specimens, rigs of an ensemble that training has not seen: one in ``folds``, drawn by the seed
    ``S7``  other specimens, operating points between those of training: one in ``folds``, drawn by the seed
    ======  ===========================================================================================

    Measured rows are split by ``recording``, ``machine``, ``load`` or ``set`` (a published set is S6 of recordings):
    one in ``folds`` of these is held out. Averages of one recording stay together.

    From S1 on no specimen is on both sides: held-out cases are tested on held-out specimens only. Held-out cases of
    training specimens, and training cases of held-out ones, are neither.

    Parameters
    ----------
    name
        Name of the split.
    rows
        ``specimen``, ``draw``, ``tooth``, ``teeth``, ``stiffness_loss``, ``phase_shift_deg`` and ``damaged_teeth`` of
        each row; ``rig_member`` for S6, ``speed_rpm`` and
        ``torque`` for S7.
    seed
        Seed of the database, by which specimens are dealt into folds.
    folds
        Folds of specimens (of draws for S0), of which one is held out.
    held_out
        Number of that fold, from 0. Models are trained with the first one held out.
    allow_leak
        Whether the split ``random`` may be made, in which averages of one recording are on both sides.

    Returns
    -------
    Split
        Table of cases and their folds.

    Raises
    ------
    InputError
        If there is no such split, the rows cannot be split so, or a fold lacks a class.
    """
    if name not in SPLITS:
        raise InputError(f"split = {name!r} does not exist{suggestion(name, SPLITS)}")
    _check_kind(name, rows, allow_leak)
    split = SPLITS[name](rows, Folds(seed=seed, number=folds, held_out=held_out))
    split.check_classes(rows)
    return split


def _check_kind(name: str, rows: pd.DataFrame, allow_leak: bool) -> None:
    """Refuse a split of simulated rows for measured ones, the other way round, and one that leaks."""
    measured, by = "recording" in rows, ", ".join(MEASURED_SPLITS[:-1])
    if measured != (name in MEASURED_SPLITS):
        kind = (
            f"measured rows are split by {by}" if measured else f"it is of recordings; choose {', '.join(_OF_SWEEPS)}"
        )
        raise InputError(f"split {name} is not one of these rows: {kind}")
    if name == "random" and not allow_leak:
        raise InputError(
            "a random split puts averages of one recording into training and test, and a model then knows the "
            f"recording again; split by {by}, or allow the leak (--allow-leak), which marks card and page"
        )


def _by_column(column: str) -> Callable[[pd.DataFrame, Folds], Split]:
    """Return the split of measured rows by the values of a column."""

    def split(rows: pd.DataFrame, folds: Folds) -> Split:
        values = rows[column].astype(str)
        named = values[~values.isin(["", "nan", "None"])].nunique()
        if named < 2 or named < values.nunique():
            raise InputError(
                f"split {column} needs two values or more of {column}, and one of each row; there are {named}; choose "
                f"another of {', '.join(MEASURED_SPLITS[:-1])}"
            )
        codes = pd.Series(pd.factorize(values, sort=True)[0], index=rows.index)
        number = min(folds.number, named)
        dealt = specimen_folds(folds.seed, codes, number, rows["tooth"] > 0)
        held_out = codes.map(dealt) == folds.held_out % number
        table = rows[["specimen"]].assign(fold=np.where(held_out, TEST, TRAINING)).drop_duplicates()
        listed = ", ".join(sorted(values[held_out].unique())[:8])
        text = f"by {column}: {listed} held out of training; averages of one recording stay together"
        return Split(name=column, text=text, table=table, by_health=True)

    return split


def _random(rows: pd.DataFrame, folds: Folds) -> Split:
    table = rows[["specimen", "draw"]].drop_duplicates()
    drawn = np.random.default_rng(folds.seed).permutation(len(table)) % folds.number
    return Split(
        name="random",
        text="LEAKS: at random, so that averages of one recording are in training and in test",
        table=table.assign(fold=np.where(drawn == folds.held_out, TEST, TRAINING)),
        shares_specimens=True,
        by_health=True,
    )


def _new_noise(rows: pd.DataFrame, folds: Folds) -> Split:
    draws = rows.groupby(rows["tooth"] > 0)["draw"].nunique()
    if draws.min() < 2:
        raise InputError("split S0 needs two noise draws or more of every case; set draws in [sweep] to 2 or more")
    table = rows[["draw"]].drop_duplicates()
    number = min(folds.number, int(draws.min()))
    held_out = table["draw"] % number == folds.held_out % number
    return Split(
        name="S0",
        text="new noise only: other draws of the same specimens and cases. A sanity check, too kind for a headline",
        table=table.assign(fold=np.where(held_out, TEST, TRAINING)),
        shares_specimens=True,
    )


def _by_specimen(rows: pd.DataFrame, folds: Folds) -> Split:
    table = rows[["specimen"]].drop_duplicates()
    held_out = _held_out(table, rows, folds)
    return Split(
        name="S1",
        text="by specimen: specimens held out of training, the same cases",
        table=table.assign(fold=np.where(held_out, TEST, TRAINING)),
    )


def _between(rows: pd.DataFrame, folds: Folds) -> Split:
    return _of_severities(
        rows,
        between,
        folds,
        name="S2",
        text="between the grid's values: severities between those of training, and specimens held out of it",
        needs="three values or more of a severity with the others equal",
    )


def _beyond(rows: pd.DataFrame, folds: Folds) -> Split:
    return _of_severities(
        rows,
        beyond,
        folds,
        name="S3",
        text="beyond the grid: severities greater than those of training, and specimens held out of it",
        needs="three magnitudes or more of a severity",
    )


def _of_severities(
    rows: pd.DataFrame,
    choose: Callable[[pd.DataFrame], BoolArray],
    folds: Folds,
    *,
    name: str,
    text: str,
    needs: str,
) -> Split:
    cases = rows[list(QUANTITIES)].drop_duplicates().reset_index(drop=True)
    # Healthy rows have no severity, and those of a pattern have several.
    severe = (cases["damaged_teeth"] > 0) & cases.notna().all(axis=1)
    held_out = severe.copy()
    held_out[severe] = choose(cases[severe])
    if not held_out.any() or held_out[severe].all():
        raise InputError(f"split {name} needs {needs}; give [sweep] a finer grid")
    cases = cases.assign(trained=~held_out, tested=held_out | (cases["damaged_teeth"] == 0))
    return Split(name=name, text=text, table=_crossed(rows, cases, folds))


def _tooth_counts(rows: pd.DataFrame, folds: Folds) -> Split:
    counts = np.unique(rows["teeth"])
    if len(counts) < 2:
        raise InputError(
            f"split S4 needs two tooth counts or more, all rows have {counts[0]}; sweep GEAR.teeth in [sweep]"
        )
    unseen = counts[len(counts) // 2]
    cases = pd.DataFrame({"teeth": counts, "trained": counts != unseen, "tested": counts == unseen})
    return Split(
        name="S4",
        text=f"unseen tooth count: gears of {unseen} teeth and specimens, both absent from training",
        table=_crossed(rows, cases, folds),
    )


def _unknown_rig(rows: pd.DataFrame, folds: Folds) -> Split:
    members = np.unique(rows[MEMBER]) if MEMBER in rows else np.empty(0)
    if len(members) < 2:
        raise InputError(
            "split S6 needs rigs of an ensemble, two or more; give [sweep.ensemble] with the number of its members"
        )
    drawn = np.random.default_rng(folds.seed).permutation(members)
    number = max(1, round(len(members) / folds.number))
    unseen = np.sort(np.roll(drawn, -folds.held_out * number)[:number])
    out = np.isin(members, unseen)
    listed = ", ".join(f"{member:g}" for member in unseen)
    return Split(
        name="S6",
        text=f"unknown rig: members {listed} of {len(members)} and specimens, both absent from training",
        table=_crossed(rows, pd.DataFrame({MEMBER: members, "trained": ~out, "tested": out}), folds),
    )


def _operating_points(rows: pd.DataFrame, folds: Folds) -> Split:
    points = rows[list(POINT)].drop_duplicates().sort_values(list(POINT)).reset_index(drop=True)
    varying = points.loc[:, points.nunique() > 1]
    between_others = np.flatnonzero(((varying > varying.min()) & (varying < varying.max())).all(axis=1))
    number = max(1, round(len(points) / folds.number))
    if varying.empty or len(between_others) < number:
        raise InputError(
            "split S7 needs operating points whose speed and torque are between those of others; sweep more of them"
        )
    drawn = np.random.default_rng(folds.seed).permutation(between_others)
    unseen = np.roll(drawn, -folds.held_out * number)[:number]
    out = points.index.isin(unseen)
    return Split(
        name="S7",
        text=f"unknown operating points: {number} of {len(points)}, between the others, and specimens, both absent "
        "from training",
        table=_crossed(rows, points.assign(trained=~out, tested=out), folds),
    )


def _crossed(rows: pd.DataFrame, cases: pd.DataFrame, folds: Folds) -> pd.DataFrame:
    """Return folds of specimens crossed with cases, which are trained on, tested, or both."""
    keys = [name for name in cases.columns if name not in ("trained", "tested")]
    table = rows[["specimen", *keys]].drop_duplicates().merge(cases, how="left", on=keys)
    held_out = _held_out(table, rows, folds)
    fold = np.select([held_out & table["tested"], ~held_out & table["trained"]], [TEST, TRAINING], ASIDE)
    return table[["specimen", *keys]].assign(fold=fold)


def _held_out(table: pd.DataFrame, rows: pd.DataFrame, folds: Folds) -> pd.Series:
    """Return whether each row of a table is of a held-out specimen."""
    dealt = specimen_folds(folds.seed, rows["specimen"], folds.number, rows["tooth"])
    return table["specimen"].map(dealt) == folds.held_out


SPLITS: dict[str, Callable[[pd.DataFrame, Folds], Split]] = {
    "S0": _new_noise,
    "S1": _by_specimen,
    "S2": _between,
    "S3": _beyond,
    "S4": _tooth_counts,
    "S6": _unknown_rig,
    "S7": _operating_points,
    **{name: _by_column(name) for name in MEASURED_SPLITS[:-1]},
    "random": _random,
}
"""Splits of one database by name."""

_OF_SWEEPS = tuple(name for name in SPLITS if name not in MEASURED_SPLITS)

_NOT_FORM = ("name", "title", "sources", "assumed", "operating")


def model_form(resolved: Mapping[str, Any]) -> dict[str, str]:
    """Return the SHA-256 of each part of a database's description that makes its model form: its rig and its solver.

    Sources of numbers and what is assumed of them are left out. Two databases whose parts are all equal differ in
    cases, specimens and noise only. Where a part differs, a model of one that is evaluated on the other has the split
    S5.
    """
    return _form(resolved, ("sources", "assumed"))


def changed_parts(form: Mapping[str, str], resolved: Mapping[str, Any]) -> list[str]:
    """Return the names of the parts in which a model form differs from a database's description."""
    now, before = model_form(resolved), _form(resolved, ("assumed",))  # forms once had the sources in them
    names = form.keys() | now.keys()
    return sorted(name for name in names if form.get(name) not in (now.get(name), before.get(name)))


def _form(resolved: Mapping[str, Any], left_out: tuple[str, ...]) -> dict[str, str]:
    rig = resolved.get("rig", {})  # recordings have none
    parts = {f"rig.{name}": without_keys(part, left_out) for name, part in rig.items() if name not in _NOT_FORM}
    parts |= {name: resolved[name] for name in ("solver",) if name in resolved}
    return {
        name: hashlib.sha256(json.dumps(part, sort_keys=True, default=str).encode()).hexdigest()
        for name, part in sorted(parts.items())
    }
