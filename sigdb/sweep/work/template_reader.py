"""The stored templates of a database that is being made, read row group by row group."""

from collections.abc import Sequence
from functools import lru_cache

import pyarrow as pa
import pyarrow.parquet as pq

from sigdb.database import ROW_GROUP, Store, Template, open_checked, read_receipt
from sigdb.sweep.plan.plan import PART_TEMPLATES

_FILES_KEPT, _GROUPS_KEPT, _TEMPLATES_KEPT = 4, 2, 16


class TemplateReader:
    """Templates by number. Rows ask for them in order, so few are kept, and few of their row groups."""

    def __init__(self, store: Store, sensors: Sequence[str]) -> None:
        self._store, self._sensors = store, sensors
        self._file = lru_cache(_FILES_KEPT)(self._opened)
        self._group = lru_cache(_GROUPS_KEPT)(self._read)
        self._template = lru_cache(_TEMPLATES_KEPT)(self._made)

    def __getitem__(self, number: int) -> Template:
        return self._template(number)

    def _opened(self, part: int) -> pq.ParquetFile:
        record = read_receipt(self._store, "templates", part).file("templates")
        return pq.ParquetFile(open_checked(self._store, record))

    def _read(self, part: int, group: int) -> pa.Table:
        return self._file(part).read_row_group(group)

    def _made(self, number: int) -> Template:
        part, within = divmod(number, PART_TEMPLATES)
        group, place = divmod(within, ROW_GROUP["templates"])
        stored = self._group(part, group).slice(place, 1)
        row = {name: column[0] for name, column in zip(stored.column_names, stored, strict=True)}
        return Template.from_row(row, self._sensors)
