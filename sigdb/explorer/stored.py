"""A database as a page shows it: its columns, tables by SQL, rows, maps and the nearest templates."""

from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import InputError, suggestion
from sigdb.database import Database, read_coverage
from sigdb.explorer.live import Shown
from sigdb.explorer.panels import average_panels
from sigdb.signature import INDICATORS, indicators

_SECONDS, _ROWS, _MEMORY_GB = 20.0, 2000, 1.0
"""Limits of a query of a page."""
_CELLS = 400
"""Values on an axis of a map at most."""
_CLASSES = 40
"""Classes of a distribution."""


class StoredRows:
    """A database behind a page.

    Parameters
    ----------
    database : Database
        The database.
    """

    def __init__(self, database: Database) -> None:
        self.database = database

    def facts(self) -> dict[str, Any]:
        """Return name, sensors, number of rows and columns, each with its unit and description."""
        coverage = read_coverage(self.database.store, self.database.manifest)
        return {
            "name": str(self.database.store),
            "rows": len(self.database),
            "sensors": list(self.database.sensors),
            "columns": self._columns(),
            "coverage": None if coverage is None else {"threshold": coverage.threshold, "sensor": coverage.sensor},
        }

    def _columns(self) -> list[dict[str, Any]]:
        columns = []
        for field in self.database.dataset("features").schema:
            text = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
            number = pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
            columns.append(
                {
                    "name": field.name,
                    "unit": text.get("unit", ""),
                    "help": text.get("description", ""),
                    "number": number,
                }
            )
        return columns

    def table(self, sql: str) -> dict[str, Any]:
        """Return the result of one SELECT statement: ``columns`` and ``rows``, at most 2000 of them.

        Raises
        ------
        InputError
            If the statement is not one SELECT, names a thing that does not exist, or reaches a limit.
        """
        frame = self.database.sql(sql, max_seconds=_SECONDS, max_memory_gb=_MEMORY_GB, max_rows=_ROWS)
        return _plain_table(frame)

    def row(self, id: int, sensor: str | None) -> Shown:
        """Return what the page draws of a row.

        Raises
        ------
        InputError
            If there is no such row, or it has no result.
        """
        case = self.database.cases(f"id = {int(id)}")
        if case.empty:
            raise InputError(f"row {id} is not in the database; its rows are those of: select id from cases")
        facts = {name: _plain_cell(value) for name, value in case.iloc[0].items()}
        tsa = self.database.signals([int(id)], sensor=sensor)["tsa"][0].astype(float)
        if not np.isfinite(tsa).all() or not len(tsa):
            raise InputError(f"row {id} has no signal: {facts.get('status')}")
        # Recordings without labels have no tooth.
        teeth, tooth = int(facts["teeth"]), int(facts["tooth"] or 0)
        damaged = max(int(facts.get("damaged_teeth") or 0), 1) if tooth else 0
        unit = self.database.unit("tsa", sensor)
        values = indicators(tsa, teeth=teeth)
        return Shown(
            facts={
                "id": int(id),
                "teeth": teeth,
                "damaged": [(tooth - 1 + i) % teeth + 1 for i in range(damaged)],
                "sensor": self.database.stored_sensor(sensor),
                "unit": unit,
                "case": facts,
                "indicators": [
                    {
                        "name": name,
                        "help": INDICATORS[name].help,
                        "unit": INDICATORS[name].unit.replace("signal", unit),
                        "value": float(value),
                        "healthy": None,
                    }
                    for name, value in values.items()
                ],
            },
            arrays=average_panels(tsa, teeth),
        )

    def map(self, x: str, y: str | None, value: str, where: str | None) -> dict[str, Any]:
        """Return a column over two axes, or the distribution of a column over one.

        Parameters
        ----------
        x : str
            Column of the first axis.
        y : str or None
            Column of the second axis; None for the values of the column itself, in 40 classes.
        value : str
            The column.
        where : str or None
            A condition on the rows, in SQL.

        Returns
        -------
        dict
            ``x`` and ``y`` values, and by y and x the ``mean`` of the column and the ``count`` of rows.

        Raises
        ------
        InputError
            If a column does not exist or is no number, or an axis has too many values.
        """
        names = [column["name"] for column in self._columns() if column["number"]]
        for name in (x, value, *([y] if y else [])):
            if name not in names:
                raise InputError(f"column {name!r} is no number of the database{suggestion(name, names)}")
        condition = f" where ({where})" if where else ""
        second = f'"{y}"' if y else self._class_of(value, condition)
        frame = self.database.sql(
            f'select "{x}" as x, {second} as y, avg("{value}") as mean, count(*) as rows from cases{condition}'
            " group by all order by all",
            max_seconds=_SECONDS,
            max_memory_gb=_MEMORY_GB,
            max_rows=_CELLS**2,
        ).dropna(subset=["x", "y"])
        for axis, name in (("x", x), ("y", y or value)):
            if frame[axis].nunique() > _CELLS:
                raise InputError(f"{name} has {frame[axis].nunique()} values; an axis has at most {_CELLS}")
        means, counts = (frame.pivot(index="y", columns="x", values=name) for name in ("mean", "rows"))
        return {
            "x": [_plain_cell(each) for each in means.columns],
            "y": [_plain_cell(each) for each in means.index],
            "mean": [[_plain_cell(each) for each in line] for line in means.to_numpy()],
            "count": [[_plain_cell(each) for each in line] for line in counts.fillna(0).to_numpy()],
        }

    def _class_of(self, value: str, condition: str) -> str:
        """Return SQL of the middle of the class of a value."""
        low, high = self.database.sql(f'select min("{value}"), max("{value}") from cases{condition}').iloc[0]
        if not np.isfinite([low, high]).all():
            raise InputError(f"column {value!r} has no values in these rows")
        width = (high - low) / _CLASSES or 1.0
        return f'{low} + ({width} * (least(floor(("{value}" - {low}) / {width}), {_CLASSES - 1}) + 0.5))'

    def nearest(self, tsa: np.ndarray, sensor: str | None) -> dict[str, Any]:
        """Return the ten nearest templates to an average, and the verdict whether it is outside the database.

        Raises
        ------
        InputError
            If the database has no templates of that length.
        """
        match = self.database.match(tsa, sensor=sensor, max_seconds=_SECONDS)
        return _plain_table(match.table) | {"verdict": match.verdict}


def _plain_table(frame: pd.DataFrame) -> dict[str, Any]:
    rows = [[_plain_cell(value) for value in row] for row in frame.itertuples(index=False, name=None)]
    return {"columns": [str(name) for name in frame.columns], "rows": rows}


def _plain_cell(value: Any) -> Any:
    """Return a cell as JSON has it: lists shortened to their length, not-a-number as None."""
    if isinstance(value, list | tuple | np.ndarray):
        return f"{len(value)} numbers"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value if isinstance(value, int | float | str | bool) or value is None else str(value)
