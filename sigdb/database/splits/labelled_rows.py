"""Rows with a result whose damage is known, as splits take them, and its kind."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from sigdb.core import InputError, IntArray
from sigdb.database.database import Database
from sigdb.database.splits.names import KIND, MEMBER, NO_DAMAGE, PATTERN, QUANTITIES
from sigdb.database.stored_tables import check_complete
from sigdb.transmission import ACTING, KINDS

CASE_COLUMNS = (
    *("tooth", *QUANTITIES, "specimen", "draw"),
    *("snr_db", "averages", "scatter", "teeth", "speed_rpm", "torque"),
)
"""Columns of a row that splits, estimators and evaluations need."""

_MEASURED = ("recording", "machine", "load", "set", "sha256")
"""Columns by which measured rows are split, and that which copies of a file share."""

_DAMAGE_FIELDS = tuple(dict.fromkeys(name for names in ACTING.values() for name in names))
"""Columns that kinds follow from, as far as a database has them, with ``tooth`` and ``pattern``."""


def labelled_rows(database: Database, condition: str = "", further: Iterable[str] = ()) -> pd.DataFrame:
    """Return the rows that have a result and a known tooth, by id, without arrays.

    The specimen of a measured row is its recording: averages of one recording are of the same teeth, mounting and day.
    Copies of a file are one recording. A load that is not stated is the torque. A torque that is not known counts as 0,
    and a damaged row of an unknown number of damaged teeth as one of one.

    Parameters
    ----------
    database
        A finished database.
    condition
        SQL condition on further columns; all rows if left out.
    further
        Further columns of ``features`` to return, and ``kind``, the kind of damage. That of simulated rows follows from
        the sizes of their damage (:func:`damage_kinds`); measured rows of an unknown kind are left out with it.

    Raises
    ------
    DatabaseError
        If the sweep is not finished.
    InputError
        If no measured row has a result and a known tooth.
    """
    check_complete(database)
    stored = set(database.dataset("features").schema.names)
    measured = _MEASURED if database.manifest.is_measured else ()
    names = list(dict.fromkeys((*CASE_COLUMNS, *({MEMBER} & stored), *measured, *further)))
    simulated_kind = KIND in names and not measured
    sizes = [name for name in (*_DAMAGE_FIELDS, "pattern") if name in stored] if simulated_kind else []
    columns = ", ".join(
        f'"{name}"' for name in dict.fromkeys((*names, *sizes)) if not (simulated_kind and name == KIND)
    )
    conditions = ["status = 'ok'", condition, *(["tooth is not null"] if measured else [])]
    conditions += [f"{KIND} <> 'unknown'"] if KIND in names and measured else []
    where = " and ".join(filter(None, conditions))
    rows = database.sql(f"select id, {columns} from features where {where} order by id").set_index("id")
    if simulated_kind:
        rows = rows.assign(**{KIND: damage_kinds(rows)})[names]
    return _with_specimens(database, rows) if measured else rows


def _with_specimens(database: Database, rows: pd.DataFrame) -> pd.DataFrame:
    """Return measured rows with their recordings as specimens."""
    if rows.empty:
        raise InputError(f"{database.store}: no row has a result and a known tooth; enter labels with sigdb label")
    rows["recording"] = rows.groupby("sha256")["recording"].transform("first")
    rows = rows.drop(columns="sha256")
    rows["specimen"] = pd.factorize(rows["recording"])[0]
    rows["load"] = rows["load"].fillna(rows["torque"])
    rows["torque"] = rows["torque"].fillna(0.0)
    rows["tooth"] = rows["tooth"].astype(int)
    rows["damaged_teeth"] = rows["damaged_teeth"].fillna((rows["tooth"] > 0).astype(float)).astype(int)
    return rows


def damage_kinds(cases: pd.DataFrame) -> list[str]:
    """Return the kind of damage of cases: the names of all kinds that a tooth has, or ``none`` or ``pattern``.

    Parameters
    ----------
    cases
        Cases of a database, with ``tooth``, ``pattern`` where there are any, and the sizes that it stores.

    Examples
    --------
    >>> cases = pd.DataFrame({"tooth": [0, 3, 3], "stiffness_loss": [0.0, 0.2, 0.2], "crack_depth": [0.0, 0.0, 1e-3]})
    >>> damage_kinds(cases)
    ['none', 'loss', 'loss + crack']
    """
    sizes = [size for size in KINDS if size in cases]
    acts = np.zeros((len(cases), len(sizes)), bool)
    for place, size in enumerate(sizes):
        fields = [cases[name].fillna(0).to_numpy(float) != 0 for name in ACTING[size] if name in cases]
        acts[:, place] = np.all(fields, axis=0)
    combined, of_row = np.unique(acts, axis=0, return_inverse=True)
    words = [" + ".join(KINDS[size] for size, some in zip(sizes, each, strict=True) if some) for each in combined]
    kinds = np.array([word or NO_DAMAGE for word in words] or [NO_DAMAGE], object)[of_row.ravel()]
    if "pattern" in cases:
        kinds[cases["pattern"].fillna("").to_numpy() != ""] = PATTERN
    kinds[cases["tooth"].to_numpy() == 0] = NO_DAMAGE
    return [str(kind) for kind in kinds]


def places_of_kinds(kinds: Iterable[str], classes: Sequence[str]) -> IntArray:
    """Return the place of each kind among classes; -1 for one that is not among them."""
    places = {name: place for place, name in enumerate(classes)}
    return np.array([places.get(kind, -1) for kind in kinds], int)


def kind_classes(kinds: Iterable[str]) -> tuple[str, ...]:
    """Return the kinds that occur, each once: ``none``, then those of damage in the order of the alphabet.

    Examples
    --------
    >>> kind_classes(["pit", "none", "crack", "pit"])
    ('none', 'crack', 'pit')
    """
    return (NO_DAMAGE, *sorted({*kinds} - {NO_DAMAGE}))
