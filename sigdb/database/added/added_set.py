"""A set of added features: its function, its columns, and its parts, one for each part of rows."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import pyarrow as pa

from sigdb.core import InputError
from sigdb.database.added.feature_function import FeatureFunction
from sigdb.database.store.receipts import ADDED, FileRecord, Receipt, read_receipts
from sigdb.database.store.schema import Column, Schema, suffixed
from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.database.store.store import DamagedFileError, Store

NO_AVERAGE = "the row has no average"
"""Status of the numbers of a row without a result."""


@dataclass(frozen=True, kw_only=True)
class AddedSet:
    """The columns that one function has added to a database.

    Attributes
    ----------
    module, function
        Module and name of the function.
    module_sha256
        SHA-256 of the module's source file.
    names
        Names of the function's numbers.
    sensors
        Stored sensors; the first one's columns have no suffix.
    help
        Description of the columns.
    """

    module: str
    function: str
    module_sha256: str
    names: tuple[str, ...]
    sensors: tuple[str, ...]
    help: str

    @property
    def name(self) -> str:
        """Name of the set: module and function."""
        return f"{self.module}.{self.function}"

    @property
    def title(self) -> str:
        """The function, as a command takes it."""
        return f"{self.module}:{self.function}"

    @property
    def kind(self) -> str:
        """Kind of its parts."""
        return f"{ADDED}.{self.name}"

    @property
    def table(self) -> str:
        """Table of its parts."""
        return f"{ADDED}/{self.name}"

    @property
    def file(self) -> str:
        """Name of the file that describes it."""
        return f"{ADDED}/{self.name}.json"

    @property
    def status(self) -> str:
        """Column that is ``ok``, or says why a row has no numbers."""
        return f"{self.function}_status"

    @property
    def hash(self) -> str:
        """SHA-256 of the description."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()

    @property
    def columns(self) -> tuple[Column, ...]:
        """Its columns: the numbers of each sensor, then the status."""
        numbers = [
            Column(
                name=suffixed(name, self.sensors, sensor),
                type=pa.float64(),
                help=f"{self.help} Sensor {sensor}.",
                formula=f"{self.title}(tsa)[{name!r}]",
            )
            for sensor in self.sensors
            for name in self.names
        ]
        text = f"'ok', or why {self.title} gives no numbers for the row."
        return (*numbers, Column(name=self.status, type=pa.string(), help=text))

    @property
    def schema(self) -> pa.Schema:
        """Arrow schema of its files."""
        ids = Column(name="id", type=pa.int64(), help="Number of the row in the plan.")
        return pa.schema([column.field for column in (ids, *self.columns)])

    def made_by(self, folder: str) -> FeatureFunction:
        """Return its function, which is not imported yet, with a folder to import it from."""
        return FeatureFunction(module=self.module, name=self.function, sha256=self.module_sha256, folder=folder)

    def write(self, store: Store) -> None:
        """Publish the description."""
        store.put(self.file, sealed_json(asdict(self)))


def added_files(store: Store) -> list[str]:
    """Return the names of the files that describe sets of added features."""
    names = [name for name in store.sizes(ADDED) if name.endswith(".json")]
    return [name for name in names if name.count("/") == 1]


def read_added_sets(store: Store) -> list[AddedSet]:
    """Return the sets of added features of a database, by name.

    Raises
    ------
    DamagedFileError
        If a description is damaged.
    """
    return [read_added_set(store, name) for name in added_files(store)]


def read_added_set(store: Store, name: str) -> AddedSet:
    """Return the set of added features that a file describes.

    Raises
    ------
    DamagedFileError
        If it is damaged, or describes another set.
    """
    file = store.name_of(name)
    try:
        content: dict[str, Any] = unsealed(store.get(name), name=file)
        added = AddedSet(**content | {key: tuple(content[key]) for key in ("names", "sensors")})
    except DamagedFileError as error:
        raise error.with_remedy(add_again(store, name)) from None
    except (TypeError, KeyError):
        raise DamagedFileError(file, "describes no added features", add_again(store, name)) from None
    if added.file != name:
        raise DamagedFileError(file, f"is a copy of {added.file}", "delete it")
    return added


def add_again(store: Store, name: str) -> str:
    """Return the remedy for the damaged file of a set, by its name."""
    module, _, function = name.removeprefix(f"{ADDED}/").removesuffix(".json").rpartition(".")
    return f"compute its columns again with: sigdb add-features {store} {module}:{function} --replace"


def current_parts(store: Store, added: AddedSet, rows: Mapping[int, Receipt]) -> dict[int, Receipt]:
    """Return the receipts of the parts of a set that were computed from the averages that are stored now.

    Parameters
    ----------
    store
        Where the database lies.
    added
        The set.
    rows
        Receipts of the rows, by part.
    """
    receipts = {receipt.part: receipt for receipt in read_receipts(store, added.kind, {added.hash})}
    return {part: receipt for part, receipt in receipts.items() if part in rows and is_current(receipt, rows[part])}


def is_current(receipt: Receipt, rows: Receipt) -> bool:
    """Return whether a part of added features was computed from the averages of a part of rows."""
    return (receipt.first, receipt.rows, receipt.source) == (rows.first, rows.rows, rows.sha256_of("signals"))


def file_of(added: AddedSet, receipt: Receipt) -> FileRecord:
    """Return the record of the file of a part of a set."""
    return receipt.file(added.table)


def check_clashes(added: AddedSet, stored: Schema | None, others: Iterable[AddedSet]) -> None:
    """Refuse columns whose names a database has already; SQL does not distinguish capitals.

    Raises
    ------
    InputError
        Names the column, and where it is.
    """
    taken: dict[str, str] = {}
    if stored is not None:
        taken |= {
            column.name: f"table {table}" for table in ("features", "signals") for column in getattr(stored, table)
        }
    for other in others:
        taken |= {column.name: other.title for column in other.columns}
    places = {name.casefold(): place for name, place in taken.items()}
    for column in added.columns:
        if place := places.get(column.name.casefold()):
            what = "give the function" if column.name == added.status else "let the function return it under"
            raise InputError(
                f"{added.title}: the database has a column {column.name} already, of {place}; {what} another name"
            )
        places[column.name.casefold()] = added.title
