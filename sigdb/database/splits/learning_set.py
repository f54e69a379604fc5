"""Inputs, labels, groups and folds of a database, as estimators of scikit-learn take them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import BoolArray, FloatArray, InputError, IntArray, suggestion
from sigdb.database.database import Database
from sigdb.database.splits.kinds import make_split
from sigdb.database.splits.labelled_rows import labelled_rows
from sigdb.database.splits.names import KIND, MEASURED_SPLITS, QUANTITIES
from sigdb.database.splits.severity_quantities import damage_columns, severity_levels, severity_quantities
from sigdb.database.splits.split import TEST, TRAINING
from sigdb.database.store.roles import Role, role_of

Labels: TypeAlias = "pd.Series[int] | pd.Series[str] | pd.DataFrame"
"""Labels of rows, by id."""


class LearningSet(NamedTuple):
    """Rows of a database to learn from.

    Parameters
    ----------
    X : pandas.DataFrame
        (rows, inputs) columns whose role is input, by id; nan where a row has no number. An element i of a column of
        lists is the column ``NAME[i]``.
    y : pandas.Series or pandas.DataFrame
        Labels by id. Location: first damaged tooth, 0 for none. Detection: 1 for damage, 0 for none. Kind: name of the
        kind of damage, ``none`` for a healthy gear. Severity: a column for each quantity, of damaged rows only;
        nan where the damage does not have it.
    groups : pandas.Series
        Specimen of each row, by id; of a measured row its recording. Rows of a group resemble each other.
    cv : list of (ndarray, ndarray)
        Positions of training and of test rows, for each fold that is held out. The first pair is the one by which
        :func:`sigdb.recognition.train` trains. No group is on both sides, but for S0 and random.
    """

    X: pd.DataFrame
    y: Labels
    groups: "pd.Series[int]"
    cv: list[tuple[IntArray, IntArray]]


_LABELS: Mapping[str, tuple[str, Callable[[pd.DataFrame], Labels]]] = {
    "location": ("", lambda rows: rows["tooth"].astype(int)),
    "detection": ("", lambda rows: (rows["tooth"] > 0).astype(int).rename("damage")),
    KIND: ("", lambda rows: rows[KIND]),
    "severity": (
        " and ".join(f"{name} is not null" for name in ("pattern", *QUANTITIES)) + " and pattern = ''",
        lambda rows: severity_levels(rows, severity_quantities(rows)),
    ),
}
"""Condition on the rows and labels of each target."""


def learning_set(
    database: Database,
    target: str,
    *,
    split: str = "",
    columns: Sequence[str] = (),
    folds: int,
    allow_leak: bool = False,
) -> LearningSet:
    """Return inputs, labels, groups and folds; see :meth:`sigdb.database.Database.xy`."""
    rows, is_labelled = target_rows(database, target)
    place, cv = np.cumsum(is_labelled) - 1, list[tuple[IntArray, IntArray]]()
    for held_out in range(folds):
        fold = row_folds(database, rows, split=split, folds=folds, held_out=held_out, allow_leak=allow_leak)
        train, test = (place[is_labelled & (fold == side)] for side in (TRAINING, TEST))
        cv.append((train, test))
    rows = rows[is_labelled]
    if rows.empty:
        raise InputError(f"{database.store} has no damaged rows with one severity to learn from; add a grid")
    return LearningSet(
        X=inputs(database, rows.index.to_numpy(), columns),
        y=labels_of(target, rows),
        groups=rows["specimen"].astype(int),
        cv=cv,
    )


def target_rows(database: Database, target: str, where: str | None = None) -> tuple[pd.DataFrame, BoolArray]:
    """Return the rows of which a target's splits are made, by id, and which of them have a label.

    Healthy rows have no severity.

    Parameters
    ----------
    database
        A finished database.
    target
        Question to answer.
    where
        SQL condition on columns of ``features``; all rows if left out.
    """
    check_target(target, _LABELS)
    conditions = [f"({condition})" for condition in (_LABELS[target][0], where) if condition]
    further = {KIND: [KIND], "severity": damage_columns(database)}.get(target, [])
    rows = labelled_rows(database, " and ".join(conditions), further)
    damaged = (rows["tooth"] > 0).to_numpy()
    return rows, damaged if target == "severity" else np.full(len(rows), True)


def row_folds(
    database: Database, rows: pd.DataFrame, *, split: str, folds: int, held_out: int, allow_leak: bool = False
) -> np.ndarray:
    """Return the fold of each row in a split, the default one if it has no name; see :func:`make_split`."""
    name, seed = split or default_split(database), database.manifest.seed
    table = make_split(name, rows, seed=seed, folds=folds, held_out=held_out, allow_leak=allow_leak)
    return table.folds(rows)


def default_split(database: Database) -> str:
    """Return the split that is taken if none is named: other specimens, or other recordings."""
    return MEASURED_SPLITS[0] if database.manifest.is_measured else "S1"


def check_target(target: str, names: Iterable[str]) -> None:
    """Refuse a target that does not exist.

    Raises
    ------
    InputError
        Names those that do; for ``gear`` it says why no rows teach it, and how the gear is found.
    """
    if target == "gear":
        raise InputError(
            "target = 'gear' cannot be learnt: each row is the average over the turns of one gear, in which damage of "
            "another gear cancels, so that the row names the gear itself; make a database and a model of detection for "
            "each gear, and compare their log odds with sigdb.recognition.gear_probabilities"
        )
    if target not in {*names}:
        raise InputError(f"target = {target!r} does not exist; choose one of {', '.join(names)}")


def labels_of(target: str, rows: pd.DataFrame) -> Labels:
    """Return the labels of rows for a target, as :class:`LearningSet` has them."""
    return _LABELS[target][1](rows)


def inputs(database: Database, ids: IntArray, columns: Sequence[str] = ()) -> pd.DataFrame:
    """Return the input columns of rows, lists element by element, in the order of the ids.

    Parameters
    ----------
    database
        A database.
    ids
        Ids of rows.
    columns
        Names of columns; all of ``features`` whose role is input if left out.

    Raises
    ------
    InputError
        If a column does not exist, is no number, or its role is not input.
    """
    tables = input_tables(database, columns)
    frames = list[pd.DataFrame]()
    for table in ("features", "signals"):
        wanted = [name for name, place in tables.items() if place == table]
        if wanted:
            schema = database.dataset(table).schema
            frames.append(_numbers(database, table, schema, wanted, ids).loc[ids])
    return pd.concat(frames, axis=1)


def input_tables(database: Database, columns: Sequence[str] = ()) -> dict[str, str]:
    """Return the table of each input column, all of ``features`` whose role is input if none is named.

    Raises
    ------
    InputError
        As :func:`inputs`.
    """
    if isinstance(columns, str):
        raise InputError(f"columns = {columns!r} must be a list of names, such as [{columns!r}]")
    tables = {name: database.dataset(name).schema for name in ("features", "signals")}
    places = {name: table for table, schema in reversed(tables.items()) for name in schema.names}
    names = list(columns) or [field.name for field in tables["features"] if _is_input(field)]
    for name in names:
        _check_input(name, places)
    return {name: places[name] for name in names}


def _is_input(field: pa.Field) -> bool:
    kind = field.type.value_type if pa.types.is_list(field.type) else field.type
    return _reads(field.name) and (pa.types.is_floating(kind) or pa.types.is_integer(kind))


def _reads(name: str) -> bool:
    return role_of(name) is Role.INPUT


def _check_input(name: str, places: Mapping[str, str]) -> None:
    if name not in places:
        raise InputError(f"columns: there is no column {name!r}{suggestion(name, filter(_reads, places))}")
    if not _reads(name):
        raise InputError(
            f"columns: {name} has the role {role_of(name)}, not input: a model that reads it would not work on a "
            "measurement"
        )


def _numbers(database: Database, table: str, schema: pa.Schema, names: Sequence[str], ids: IntArray) -> pd.DataFrame:
    """Return columns of numbers of rows, by id; lists as a column for each element."""
    listed = ", ".join(f'"{name}"' for name in names)
    batches = database.stream(f"select id, {listed} from {table} where id between {ids.min()} and {ids.max()}")
    stored, parts = list[IntArray](), {name: list[FloatArray]() for name in names}
    for every in batches:
        batch = every.filter(pa.array(np.isin(every["id"].to_numpy(zero_copy_only=False), ids)))
        stored.append(batch["id"].to_numpy(zero_copy_only=False))
        for name in names:
            parts[name].append(_matrix(batch[name]))
    index = pd.Index(np.concatenate(stored), name="id")
    columns = dict[str, FloatArray]()
    for name, matrices in parts.items():
        width = max(matrix.shape[1] for matrix in matrices)
        whole = np.concatenate([_widened(matrix, width) for matrix in matrices])
        is_list = pa.types.is_list(schema.field(name).type)
        columns |= {f"{name}[{i}]" if is_list else name: whole[:, i] for i in range(width)}
    return pd.DataFrame(columns, index=index)


def _matrix(column: pa.Array) -> FloatArray:
    """Return a column as a matrix, (rows, elements); nan where a row has fewer."""
    if not pa.types.is_list(column.type):
        return np.asarray(column.cast(pa.float64()).to_numpy(zero_copy_only=False), float)[:, None]
    lengths = np.diff(column.offsets.to_numpy())
    lengths[column.is_null().to_numpy(zero_copy_only=False)] = 0
    matrix = np.full((len(column), lengths.max(initial=0)), np.nan)
    matrix[np.arange(matrix.shape[1]) < lengths[:, None]] = column.flatten().to_numpy(zero_copy_only=False)
    return matrix


def _widened(matrix: FloatArray, width: int) -> FloatArray:
    return np.pad(matrix, ((0, 0), (0, width - matrix.shape[1])), constant_values=np.nan)
