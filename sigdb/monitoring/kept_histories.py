"""Finished histories of a database in the user's cache: one whose content is as it was is not looked at again."""

from collections.abc import Mapping
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.monitoring.history import GearHistory
from sigdb.monitoring.kept_table import keep_table, kept_table, list_column, text_of, values_of

_TABLES = ("looks", "tooth_map")
"""Attributes of a history with a row for each look; the others are values."""


_NONE = pa.table({"tooth_map": pa.array([], pa.list_(pa.float64()))})


class KeptHistories:
    """Histories by their content: all that they were computed from.

    Parameters
    ----------
    place
        The file.
    """

    def __init__(self, place: Path) -> None:
        self._place = place
        table, values = kept_table(place)
        self._table = _NONE if table is None else table
        self._values: dict[str, str] = {} if values is None else values["histories"]
        ends = [] if values is None else np.cumsum(values["looks"]).tolist()
        self._rows = {
            content: slice(start, end) for content, start, end in zip(self._values, [0, *ends], ends, strict=False)
        }

    @cached_property
    def _looks(self) -> pd.DataFrame:
        looks: pd.DataFrame = self._table.drop_columns(["tooth_map"]).to_pandas()
        return looks

    @cached_property
    def _tooth_maps(self) -> pa.ListArray:
        return self._table["tooth_map"].combine_chunks()

    def __contains__(self, content: str) -> bool:
        return content in self._values

    def __getitem__(self, content: str) -> GearHistory:
        rows, values = self._rows[content], values_of(self._values[content])
        values["notes"] = tuple(values["notes"])
        if rows.start == rows.stop:
            return GearHistory(**values, looks=pd.DataFrame(), tooth_map=np.zeros((0, 0)))
        looks = self._looks.iloc[rows]
        looks.index = pd.RangeIndex(len(looks))
        maps = self._tooth_maps[rows].flatten().to_numpy().reshape(len(looks), -1)
        return GearHistory(**values, looks=looks, tooth_map=maps)

    def keep(self, histories: Mapping[str, GearHistory]) -> None:
        """Write histories by their content in place of those before, unless they are the same."""
        if list(histories) == list(self._values):
            return
        tables = [
            self._table[self._rows[content]] if content in self._rows else _table(history)
            for content, history in histories.items()
        ]
        values = {
            content: self._values.get(content) or text_of(_values(history)) for content, history in histories.items()
        }
        counts = [len(history.looks) for history in histories.values()]
        some = [table for table in tables if table.num_rows]
        keep_table(self._place, pa.concat_tables(some) if some else _NONE, {"histories": values, "looks": counts})


def _values(history: GearHistory) -> dict[str, Any]:
    return {each.name: getattr(history, each.name) for each in fields(history) if each.name not in _TABLES}


def _table(history: GearHistory) -> pa.Table:
    if history.looks.empty:
        return pa.table({})
    table = pa.Table.from_pandas(history.looks, preserve_index=False).replace_schema_metadata()
    return table.append_column("tooth_map", list_column(history.tooth_map))
