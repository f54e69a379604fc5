"""Added features: columns that a function of its user computes from the averages of a database."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from sigdb.core import CorruptionError, DatabaseError, InputError, OnProgress, Progress, ignore
from sigdb.database import (
    FACTS,
    AddedSet,
    AddedWork,
    Database,
    FeatureFunction,
    LoadedFunction,
    Receipt,
    Store,
    added_files,
    check_clashes,
    current_parts,
    finished_parts,
    make_added_part,
    part_name,
    probed_names,
    read_added_set,
    read_added_sets,
    read_schema,
    receipt_name,
    tables_of,
)
from sigdb.sweep.work.engines import Engine, Processes, make_missing
from sigdb.sweep.work.ownership import ownership_of


@dataclass(frozen=True, kw_only=True)
class AddedSummary:
    """Summary of added features.

    Attributes
    ----------
    columns : tuple of str
        Names of the columns, the status last.
    new_rows : int
        Number of rows that this run computed; 0 if there was nothing to do.
    rows : int
        Number of rows that have the columns.
    failed : int
        Number of rows whose status is not ``ok``: the function failed, or the row has no average.
    """

    columns: tuple[str, ...]
    new_rows: int
    rows: int
    failed: int


def add_features(
    location: str | PathLike[str],
    function: str | Callable[..., Any],
    *,
    jobs: int = -1,
    replace: bool = False,
    on_progress: OnProgress = ignore,
) -> AddedSummary:
    """Add columns that a function computes from the stored averages, or go on with them.

    The function takes an average, an array of the samples of one revolution, and returns a mapping of names to numbers.
    Each name becomes a column of ``features``; averages of further sensors give columns with their suffix. A parameter
    of the function that is called ``teeth``, ``speed_rpm``, ``torque``, ``averages``, ``scatter``, ``sensor`` or
    ``unit`` gets that fact of the row; labels are not given. A row for which the function fails has nulls, and the
    column ``FUNCTION_status`` says why.

    The files of the database stay as they are. Parts have receipts of their own. After a stop at any instant, or when
    the database has grown, the same call computes what is missing.

    Parameters
    ----------
    location : str or path-like
        Directory of the database, or its place in an object store.
    function : str or callable
        ``"MODULE:FUNCTION"``, or the function of a module that other processes can import.
    jobs : int
        Number of worker processes; -1 for one on each core.
    replace : bool
        Whether to compute all rows again, for example because the function has changed.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` whenever a part is finished.

    Returns
    -------
    AddedSummary
        Columns, and counts of rows.

    Raises
    ------
    InputError
        If there is no such function, it gives numbers for no row, its module has changed since columns were computed
        with it, or a name is that of another column.
    DatabaseError
        If the database has no rows yet, another process works on it, or it cannot be written.

    Examples
    --------
    With a module ``shape.py``::

        def crest(tsa):
            return {"crest": abs(tsa).max() / tsa.std()}

    ``sigdb.add_features("signatures", "shape:crest")`` adds the columns ``crest`` and ``crest_status``.
    """
    store, made_by = Store.at(location), FeatureFunction.of(function)
    with ownership_of(store):
        store.clear_temporary()
        if replace:
            _forget(store, f"{made_by.module}.{made_by.name}")
        with Database(store) as database:
            rows = {receipt.part: receipt for receipt in database.receipts("rows")}
            work = AddedWork(added=_described(database, made_by), function=made_by, units=_units(database))
        new = finish_added(work, store, rows, Processes(jobs), on_progress)
        parts = current_parts(store, work.added, rows).values()
        return AddedSummary(
            columns=tuple(column.name for column in work.added.columns),
            new_rows=new,
            rows=sum(part.rows for part in parts),
            failed=sum(part.failed for part in parts),
        )


def remove_features(location: str | PathLike[str], function: str) -> tuple[str, ...]:
    """Remove the columns that a function has added; its module is not needed.

    Parameters
    ----------
    location : str or path-like
        Directory of the database, or its place in an object store.
    function : str
        ``"MODULE:FUNCTION"``.

    Returns
    -------
    tuple of str
        Names of the columns.

    Raises
    ------
    InputError
        If there are no such columns.
    """
    store = Store.at(location)
    with ownership_of(store):
        added = {each.title: each for each in read_added_sets(store)}
        if function not in added:
            titles = ", ".join(added) or "none"
            raise InputError(f"{store} has no features that {function} has added; added: {titles}")
        _forget(store, added[function].name)
    return tuple(column.name for column in added[function].columns)


def finish_added(
    work: AddedWork, store: Store, rows: dict[int, Receipt], engine: Engine, on_progress: OnProgress = ignore
) -> int:
    """Compute the missing parts of a set and return the number of new rows. The caller owns the place."""
    total = sum(receipt.rows for receipt in rows.values())

    def count() -> dict[int, int]:
        return {part: receipt.rows for part, receipt in current_parts(store, work.added, rows).items()}

    def report() -> None:
        on_progress(Progress(stage=work.added.title, done=sum(finished.values()), total=total, before=before))

    finished = count()
    before = sum(finished.values())
    report()
    make_missing(
        engine,
        make_added_part,
        work,
        store,
        numbers=sorted(rows),
        finished=finished,
        recount=count,
        report=report,
        total=f"{total} rows",
    )
    return total - before


def finish_all_added(store: Store, engine: Engine, on_progress: OnProgress = ignore) -> None:
    """Compute the missing parts of all sets whose functions can be imported unchanged. The caller owns the place."""
    for name in added_files(store):
        with suppress(InputError, CorruptionError), Database(store) as database:
            rows = {receipt.part: receipt for receipt in database.receipts("rows")}
            added = read_added_set(store, name)
            function = added.made_by(str(Path.cwd()))
            function.load()
            finish_added(
                AddedWork(added=added, function=function, units=_units(database)), store, rows, engine, on_progress
            )


def _described(database: Database, made_by: FeatureFunction) -> AddedSet:
    """Return the description of the set of a function, which is written if there is none."""
    others = {added.title: added for added in database.added}
    begun = others.pop(str(made_by), None)
    if begun is not None and begun.module_sha256 != made_by.sha256:
        raise InputError(
            f"{made_by}: the module {made_by.module} has changed since {database.store} got its columns (SHA-256 "
            f"{begun.module_sha256[:12]}... then, {made_by.sha256[:12]}... now); compute all again with --replace "
            "(replace=True), or give the new function another name"
        )
    if begun is not None:
        return begun
    if not len(database):
        raise DatabaseError(f"{database.store} has no finished rows yet; add features when it has some")
    loaded = made_by.load()
    names, why = _names_of(database, loaded)
    if not names:
        raise InputError(
            f"{made_by} gives no numbers for up to {_PROBED} rows of each tooth count of {database.store}; for "
            f"the first one: {why}"
        )
    added = AddedSet(
        module=made_by.module,
        function=made_by.name,
        module_sha256=made_by.sha256,
        names=tuple(names),
        sensors=database.sensors,
        help=loaded.help or f"Number that {made_by} computes from the average.",
    )
    check_clashes(added, read_schema(database.store), others.values())
    added.write(database.store)
    return added


_PROBED = 32
"""Rows of each tooth count that show which names a function gives."""

_PROBE = """
select * from features where status = 'ok' qualify row_number() over (partition by teeth order by hash(id)) <= {rows}
order by id
"""


def _names_of(database: Database, function: LoadedFunction) -> tuple[list[str], str]:
    """Return the names of the numbers of a function, and why it gave none for some row."""
    stored = database.dataset("features").schema.names
    facts = ", ".join(f'"{name}"' for name in ("id", *FACTS) if name in stored)
    rows = database.arrow(_PROBE.format(rows=_PROBED).replace("*", facts, 1))
    if not rows.num_rows:
        return [], "no row has an average"
    averages = database.signal_rows(rows["id"].to_numpy(), ["tsa"])
    return probed_names(function, rows.append_column("tsa", averages["tsa"]), database.sensors, _units(database))


def _units(database: Database) -> dict[str, str]:
    return {sensor: database.unit("tsa", sensor) for sensor in database.sensors}


def _forget(store: Store, name: str) -> None:
    """Delete the files of a set, the description first: without it the others belong to nothing."""
    kind = f"added.{name}"
    store.delete(f"added/{name}.json")
    for part in finished_parts(store, kind):
        store.delete(receipt_name(kind, part))
        for table in tables_of(kind):
            store.delete(part_name(table, part))
