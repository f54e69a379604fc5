"""Match: the templates that are nearest to a measured average, over all turns."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import ArrayLike, NDArray

from sigdb.core import InputError
from sigdb.database.matching.index import RMS, MatchIndex, bank_batches, cached_bank
from sigdb.database.matching.nearest import Nearest, checked_average, nearest, whole_shifts
from sigdb.database.matching.outside_threshold import read_coverage
from sigdb.database.query import Connection
from sigdb.database.store.schema import suffixed

if TYPE_CHECKING:
    from sigdb.database.database import Database

_BANK_FORMAT = 2


@dataclass(frozen=True, kw_only=True)
class Match:
    """The nearest templates; see :meth:`Database.match`.

    Attributes
    ----------
    table
        One row a template, the nearest first.
    threshold
        Greatest misfit of a signature that the database covers; None where coverage was not studied.
    """

    table: pd.DataFrame
    threshold: float | None

    @property
    def outside(self) -> bool | None:
        """Whether even the nearest template is farther than the threshold; None where there is none."""
        return None if self.threshold is None else bool(self.table["misfit"].iloc[0] > self.threshold)

    def __str__(self) -> str:
        return self.verdict

    @property
    def verdict(self) -> str:
        """What :attr:`outside` means, in a sentence."""
        least = self.table["misfit"].iloc[0]
        if self.threshold is None:
            return "not known whether it is outside the database: sigdb coverage has not been run on it"
        if self.outside:
            return f"outside the database: the least misfit {least:.3g} is above the threshold {self.threshold:.3g}"
        return f"inside the database: the least misfit {least:.3g} is within the threshold {self.threshold:.3g}"


def match_average(
    database: "Database", tsa: ArrayLike, *, k: int, sensor: str | None, turns: ArrayLike | None, where: str | None
) -> Match:
    """What :meth:`Database.match` gives."""
    x = checked_average(tsa)
    if k < 1:
        raise InputError(f"k = {k} must be 1 or more: it is the number of templates to return")
    sensor = database.stored_sensor(sensor)
    step = int(database.manifest.resolved["signature"]["samples_per_tooth"])
    shifts = whole_shifts(turns, step, x.size)
    bank = template_bank(database, sensor, x.size)
    among = _among(bank, where)
    found = nearest(bank, x, teeth=x.size // step, k=k, shifts=shifts, among=among)
    record = read_coverage(database.store, database.manifest)
    threshold = record.threshold if record is not None and record.sensor == sensor else None
    shared = set(database.dataset("features").schema.names)
    names = [name for name in bank.cases.column_names if name in shared | {"tooth"} and name != "status"]
    cases = bank.cases.select(names).take(pa.array(found.place)).to_pandas()
    return Match(table=_table(found, cases, step, threshold), threshold=threshold)


def template_bank(database: "Database", sensor: str, n: int) -> MatchIndex:
    """The templates of a sensor and of n samples, from the user's cache or the database.

    Raises
    ------
    InputError
        If no template has that length.
    """
    column = suffixed("tsa", database.sensors, sensor)
    digests = (file.sha256 for receipt in database.receipts("templates") for file in receipt.files)
    text = "\n".join([str(_BANK_FORMAT), database.manifest.hash, sensor, str(n), *digests])
    key = hashlib.sha256(text.encode()).hexdigest()
    if key not in database.banks:
        database.banks[key] = cached_bank(key, lambda: _of_length(database, column, n))
    return database.banks[key]


def _of_length(database: "Database", column: str, n: int) -> Iterator[pa.RecordBatch]:
    """Batches of the bank, or an error that names the lengths that there are.

    An extension has undamaged templates of its own: those that are there already are left out.
    """
    schema, step = database.dataset("templates").schema, database.manifest.resolved["signature"]["samples_per_tooth"]
    scalars = [field.name for field in schema if not pa.types.is_list(field.type)]
    rig = ["teeth", "speed_rpm", "torque", *(name for name in scalars if "." in name)]  # swept: by dotted path
    teeth: set[int] = set()
    undamaged: set[tuple[float, ...]] = set()

    def distinct() -> Iterator[pa.RecordBatch]:
        for batch in database.scan("templates", [*scalars, column]):
            teeth.update(batch["teeth"].filter(batch[column].is_valid()).to_pylist())
            new = np.ones(batch.num_rows, dtype=bool)
            for row in np.flatnonzero((batch["tooth"].to_numpy() == 0) & batch[column].is_valid().to_numpy(False)):
                point = tuple(batch[name][int(row)].as_py() for name in rig)
                new[row] = point not in undamaged
                undamaged.add(point)
            yield batch.filter(pa.array(new))

    batches = bank_batches(distinct(), column, n, n // step)
    first = next(batches, None)
    if first is None:
        lengths = ", ".join(f"{step * z} ({z} teeth)" for z in sorted(teeth)) or "none"
        raise InputError(
            f"tsa has {n} samples, and no template of {database.store} has; lengths that it has: {lengths}, "
            f"{step} samples a tooth"
        )
    yield first
    yield from batches


def _among(bank: MatchIndex, where: str | None) -> NDArray[np.bool_]:
    """Which templates of a bank meet a condition."""
    if where is None:
        return np.ones(bank.cases.num_rows, dtype=bool)
    with Connection({"templates": bank.cases.drop_columns([RMS])}) as connection:
        chosen = connection.choose("templates", where)["template"].to_numpy()
    among = np.isin(bank.cases["template"].to_numpy(), chosen)
    if not among.any():
        raise InputError(f"no template of this length meets where = {where!r}")
    return among


def _table(found: Nearest, cases: pd.DataFrame, samples_per_tooth: int, threshold: float | None) -> pd.DataFrame:
    """The table from the cases of the templates found, in their order."""
    first, teeth = cases["tooth"].to_numpy(), cases["teeth"].to_numpy()
    turn = found.shift / samples_per_tooth
    # Half a tooth of turn is the next tooth's.
    tooth = np.where(first > 0, (first - 1 + np.floor(turn + 0.5).astype(int)) % teeth + 1, 0)
    outside = pd.array([None if threshold is None else bool(one > threshold) for one in found.misfit], dtype="boolean")
    columns = {
        "template": cases["template"].to_numpy(),
        "tooth": tooth,
        "turn": turn,
        "match": found.match,
        "misfit": found.misfit,
        "outside": outside,
    }
    return pd.DataFrame(columns | {name: cases[name].to_numpy() for name in cases if name not in columns})
