"""Further columns of features that learners read: indicators, and features that functions of a user have added."""

from collections.abc import Iterator, Mapping, Sequence

import pandas as pd
import pyarrow as pa

from sigdb.core import InputError, suggestion
from sigdb.database import Database, suffixed

_ADDED = "added"
"""Name that stands for the features of all functions."""


def further_columns(database: Database, names: Sequence[str]) -> tuple[str, ...]:
    """Return columns of numbers by name; a function stands for all of its numbers, ``added`` for all functions.

    Parameters
    ----------
    database
        The database.
    names
        Names of columns, ``MODULE:FUNCTION`` of added features, or ``added``.

    Raises
    ------
    InputError
        If the database has no such column, or it is no result of the average: a label would be the answer.
    """
    added = {each.title: each for each in database.added}
    results, columns = _results(database), list[str]()
    every = tuple(added) or (_ADDED,)
    for name in [each for stated in names for each in (every if stated == _ADDED else (stated,))]:
        if name in added:
            columns += [column.name for column in added[name].columns if column.name in results]
        elif name in results:
            columns.append(name)
        elif name == _ADDED:
            raise InputError(f"columns: {database.store} has no added features; add some with sigdb add-features")
        elif ":" in name:
            command = f"sigdb add-features {database.store} {name}"
            raise InputError(f"columns: {database.store} has no features of {name}; add them with: {command}")
        elif name in database.dataset("features").schema.names:
            raise InputError(
                f"columns: {name} is no number that is computed from the average{suggestion(name, results)}"
            )
        else:
            why = database.why_absent(name) or f"{database.store} has no column {name}{suggestion(name, results)}"
            raise InputError(f"columns: {why}")
    return tuple(dict.fromkeys(columns))


def _results(database: Database) -> list[str]:
    """Return the columns of numbers that are computed from averages; they stand behind the scatter."""
    schema = database.dataset("features").schema
    behind = schema.names[schema.names.index("scatter") + 1 :]
    scatters = {suffixed("scatter", database.sensors, sensor) for sensor in database.sensors}
    return [name for name in behind if pa.types.is_floating(schema.field(name).type) and name not in scatters]


def functions_of(database: Database, columns: Sequence[str]) -> dict[str, str]:
    """Return the SHA-256 of the module of each function that added some of the columns, by ``MODULE:FUNCTION``."""
    return {
        each.title: each.module_sha256
        for each in database.added
        if any(column.name in columns for column in each.columns)
    }


def missing_numbers(database: Database, rows: pd.DataFrame, columns: Sequence[str]) -> Iterator[str]:
    """Yield a sentence on each of the columns that is null in some rows.

    Raises
    ------
    InputError
        If added features are not computed for some rows, or a column has no number at all.
    """
    for each in database.added:
        if not any(column.name in columns for column in each.columns):
            continue
        lacking = database.sql(f"select id from cases where status = 'ok' and \"{each.status}\" is null order by id")
        if len(lacking):
            first = lacking["id"].iloc[0]
            raise InputError(
                f"{database.store}: {len(lacking)} rows, the first with id {first}, have no features of "
                f"{each.title} yet; compute them with: sigdb add-features {database.store} {each.title}"
            )
    for name in columns:
        count = int(rows[name].isna().sum())
        if len(rows) and count == len(rows):
            raise InputError(f"columns: {name} has no number in any row of {database.store}; leave it out")
        if count:
            yield f"{name} has no number in {count} of {len(rows)} rows; the median of the others stands for it"


def check_columns_of(columns: Sequence[str], added: Mapping[str, str], database: Database) -> None:
    """Refuse a database without the further columns of a model, or with those of another function.

    Parameters
    ----------
    columns
        Further columns of the model.
    added
        SHA-256 of the module by function, see :func:`functions_of`.
    database
        The database.

    Raises
    ------
    InputError
        Names the function or the column, and what to do.
    """
    here = {each.title: each.module_sha256 for each in database.added}
    for title, sha256 in added.items():
        command = f"sigdb add-features {database.store} {title}"
        if title not in here:
            raise InputError(
                f"the model reads features of {title}, which {database.store} lacks; add them with: {command}"
            )
        if here[title] != sha256:
            raise InputError(
                f"the model reads features of {title} by a module with the SHA-256 {sha256[:12]}..., those of "
                f"{database.store} are by {here[title][:12]}...; compute them by the same module: {command} --replace, "
                "or train again"
            )
    further_columns(database, columns)
