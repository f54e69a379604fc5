"""Reading a database: cases, SQL, signals, templates, batches, match, export."""

from collections.abc import Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import ArrayLike

from sigdb.core import DatabaseError, FloatArray, InputError, IntArray
from sigdb.database.export.export import Export, export_database
from sigdb.database.matching.index import MatchIndex
from sigdb.database.matching.match import Match, match_average
from sigdb.database.query import (
    check_rows,
    check_table,
    chosen_columns,
    describe_columns,
    signal_batches,
)
from sigdb.database.signals import row_matrices
from sigdb.database.store.schema import suffixed
from sigdb.database.stored_tables import StoredTables


class Database(StoredTables):
    """A database that is read; see :func:`sigdb.open`.

    Readers follow receipts, so a sweep may go on writing meanwhile: what was finished when the database was opened
    is what is seen.
    """

    def __repr__(self) -> str:
        return f"Database({str(self.store)!r}, {len(self)} of {self.manifest.rows} rows)"

    def sql(self, query: str) -> pd.DataFrame:
        """Run one SELECT statement.

        The views are ``features`` (all columns of a row), ``cases`` (the same without lists), ``signals`` (``id``,
        ``tsa``, ``spectrum``) and ``templates``.

        Parameters
        ----------
        query
            One SELECT statement in DuckDB's SQL.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        InputError
            If it is not one SELECT statement, or names what does not exist.
        DatabaseError
            If a part that it reads is damaged.
        """
        frame: pd.DataFrame = self.arrow(query).to_pandas()
        return frame

    def arrow(self, query: str) -> pa.Table:
        """The result of one SELECT statement as an Arrow table; see :meth:`sql`."""
        with self._reading():
            return self._connection.select(query)

    def stream(self, query: str, *, rows: int = 2048) -> pa.RecordBatchReader:
        """The result of one SELECT statement in batches, as DuckDB computes them; see :meth:`sql`.

        A statement that needs all rows before it has a first one, such as one that sorts, holds its result in memory.

        Parameters
        ----------
        query
            One SELECT statement in DuckDB's SQL.
        rows
            Greatest number of rows in a batch.

        Raises
        ------
        InputError, DatabaseError
            As :meth:`sql`. Damage is told when the stream comes to it.
        """
        check_rows(rows)
        with self._reading():
            return self._connect().stream(query, rows)

    def cases(self, where: str | None = None) -> pd.DataFrame:
        """Rows without their lists: parameters, labels, indicators, by id.

        Parameters
        ----------
        where
            One SQL expression, for example ``"tooth = 6 and stiffness_loss >= 0.25"``; all rows if left out. It is
            parsed as an expression, so that nothing can be smuggled in behind it. Subqueries over the views may stand
            in it.

        Raises
        ------
        InputError
            If ``where`` is not one expression, or names what does not exist.
        """
        with self._reading():
            cases: pd.DataFrame = self._connection.choose("cases", where, order="id").to_pandas()
        return cases

    def features(self, where: str | None = None) -> pd.DataFrame:
        """Rows with their pooled Wigner-Ville features, by id; ``where`` as in :meth:`cases`."""
        with self._reading():
            features: pd.DataFrame = self._connection.choose("features", where, order="id").to_pandas()
        return features

    def batches(
        self,
        where: str | None = None,
        *,
        table: str = "features",
        columns: Sequence[str] | None = None,
        rows: int = 2048,
    ) -> pa.RecordBatchReader:
        """Rows of a table in Arrow batches, by id; memory holds a few batches and row groups, however many rows.

        Parameters
        ----------
        where
            As in :meth:`cases`, on the columns of ``features``, also for ``signals``; of ``templates`` for those.
        table
            ``features``, ``signals`` or ``templates``.
        columns
            Columns by name; all of the table's if left out.
        rows
            Greatest number of rows in a batch.

        Returns
        -------
        pyarrow.RecordBatchReader
            An iterator of record batches. Each column's field carries its unit, description and formula.

        Raises
        ------
        InputError
            If ``where``, ``table`` or ``columns`` name what does not exist.
        DatabaseError
            If a part is damaged: told when the stream comes to it.

        Examples
        --------
        Mean square of every signal with damage at tooth 6, whatever the size of the database::

            for batch in db.batches("tooth = 6", table="signals", columns=["id", "tsa"]):
                tsa = np.stack(batch["tsa"].to_numpy(zero_copy_only=False))
                square = (tsa**2).mean(axis=1)
        """
        check_table(table)
        check_rows(rows)
        schema = self.dataset(table).schema
        names = chosen_columns(schema, table, columns, self.why_absent)
        with self._reading():
            if table != "signals":
                return describe_columns(self._connect().choose_batches(table, where, names, rows), schema)
            ids = self._connect().choose_batches("features", where, ["id"], rows)
            return signal_batches(ids, lambda some: self._signal_rows(some, names), names, schema)

    def templates(self) -> pd.DataFrame:
        """Return the templates: each distinct case once.

        Where the rig turns exactly the damage is at tooth 1; else each damaged tooth has its own template.
        """
        with self._reading():
            templates: pd.DataFrame = self.dataset("templates").to_table().to_pandas()
        return templates

    def signals(self, ids: ArrayLike, *, sensor: str | None = None) -> dict[str, FloatArray]:
        """Averaged signals and order spectra of rows, found by arithmetic on their ids.

        Parameters
        ----------
        ids
            (k,) ids.
        sensor
            Name of a stored sensor; the first one if left out.

        Returns
        -------
        dict
            ``tsa`` (k, n) and ``spectrum`` (k, n // 2 + 1), float32, in the order of ``ids``; rows without a result
            are nan.

        Raises
        ------
        InputError
            If an id or the sensor is not in the database, or the rows have different lengths (other tooth counts).
        DatabaseError
            If a part is damaged.
        """
        wanted = np.atleast_1d(np.asarray(ids))
        if wanted.size and wanted.dtype.kind not in "iu":
            raise InputError(f"ids must be whole numbers, not {wanted.dtype} such as {wanted.flat[0]}")
        wanted = wanted.astype(np.int64)
        columns = self._sensor_columns(sensor)
        found = row_matrices(self._signal_rows(wanted, columns.values()), columns, wanted.size)
        if not found:  # none of the rows has a result that would tell the length
            n = self._length(wanted)
            widths = {"tsa": n, "spectrum": n // 2 + 1 if n else 0}
            return {key: np.full((wanted.size, width), np.nan, np.float32) for key, width in widths.items()}
        return found

    def _length(self, ids: IntArray) -> int:
        """Samples of a row that has no signal of its own to tell."""
        if not ids.size:
            return 0
        teeth = self.sql(f"select teeth from cases where id = {ids[0]}")["teeth"].iloc[0]
        return int(teeth) * int(self.manifest.resolved["signature"]["samples_per_tooth"])

    def _sensor_columns(self, sensor: str | None) -> dict[str, str]:
        return {key: suffixed(key, self.sensors, self.stored_sensor(sensor)) for key in ("tsa", "spectrum")}

    def unit(self, column: str, sensor: str | None = None) -> str:
        """Unit of a sensor's column of signals, ``tsa`` or ``spectrum``."""
        field = self.dataset("signals").schema.field(self._sensor_columns(sensor)[column])
        return str(field.metadata[b"unit"].decode())

    def match(
        self,
        tsa: ArrayLike,
        *,
        k: int = 10,
        sensor: str | None = None,
        turns: ArrayLike | None = None,
        where: str | None = None,
    ) -> Match:
        """The templates nearest to an average, over all turns.

        The average and the clean average of each template are divided by their standard deviations over the revolution
        and freed of their mean, mesh harmonics and shaft orders 1 and 2 (:func:`sigdb.signature.residual_signal`). With
        z and z_t what is left, the misfit is the root mean square of ``z - z_t`` turned, the match the overlap
        ``<z, z_t turned> / (|z| |z_t|)``, at the turn where they are best. Templates are ranked by misfit: under white
        noise the nearest one is the most likely, and the healthy one, whose residual is 0 and whose match is 0, takes
        part on equal terms. Only templates of the average's length, so of its tooth count, take part.

        Parameters
        ----------
        tsa
            (n,) average of one revolution of the shaft, of any unit; ``samples_per_tooth`` samples a tooth.
        k
            Number of templates to return; fewer if there are fewer.
        sensor
            Name of a stored sensor; the first one if left out.
        turns
            Turns to try, in teeth, for example ``range(12)`` where the tacho mark is known, or 0 where it is and the
            rig does not turn exactly; all samples if left out.
        where
            Which templates take part: one SQL expression on their columns, for example ``"torque > 100"``.

        Returns
        -------
        Match
            ``table``, a pandas frame of k rows: ``template``, ``tooth`` (first damaged tooth, as turned; 0 for none),
            ``turn`` (in teeth, by which the template is turned later), ``match``, ``misfit``, ``outside`` (whether the
            misfit is above the threshold that ``sigdb coverage`` stored; missing where it has not been run), and the
            template's case. ``outside`` and ``threshold`` of the whole.

        Raises
        ------
        InputError
            If the average is not one row of finite numbers that vary, or no template has its length or meets ``where``.
        DatabaseError
            If a part is damaged.

        Notes
        -----
        Spectra of the templates are kept in the user's cache directory (``SIGDB_CACHE`` names another one).
        """
        return match_average(self, tsa, k=k, sensor=sensor, turns=turns, where=where)

    @cached_property
    def banks(self) -> dict[str, MatchIndex]:
        """Templates as match reads them, those that were needed; memory-mapped."""
        return {}

    def export(
        self, path: str | Path, *, where: str | None = None, signals: bool = True, sensor: str | None = None
    ) -> Export:
        """Write rows to a file that MATLAB reads, a MAT-file (``.mat``) or HDF5 (``.h5``, ``.hdf5``).

        Columns without lists are column vectors in ``cases``: numbers as doubles, nan where there is none, text as
        cells. Averages, spectra and Wigner-Ville features are single matrices, one row a signature, padded with nan
        where tooth counts differ. Characters of a column's name that MATLAB does not take become ``_``. Units,
        descriptions and formulas are structs in a MAT-file and attributes in HDF5. In MATLAB, ``h5read`` gives an HDF5
        matrix transposed: one column a signature.

        HDF5 is written batch by batch, so a database larger than memory can be exported. A MAT-file is made in memory.

        Parameters
        ----------
        path
            The file; an old one is replaced when the new one is whole.
        where
            As in :meth:`cases`; all rows if left out.
        signals
            Whether averages and spectra are written.
        sensor
            Only this sensor's columns, without suffix; all sensors' if left out.

        Returns
        -------
        Export
            ``path``, ``rows`` and ``columns`` of what was written.

        Raises
        ------
        InputError
            If the name does not say the format, ``where`` or ``sensor`` name what does not exist, a variable is too
            large for a MAT-file, or h5py is not installed.
        DatabaseError
            If a part is damaged; then no file is written.
        """
        return export_database(self, path, where=where, signals=signals, sensor=sensor)


def open(location: str | PathLike[str]) -> Database:
    """Open a database for reading.

    Parameters
    ----------
    location
        The directory that a sweep wrote, or its place in an object store: ``s3://bucket/prefix``.

    Returns
    -------
    Database

    Raises
    ------
    InputError
        If there is no database.
    DatabaseError
        If its receipts and files do not agree.
    """
    return Database(location)


def check_complete(database: Database, columns: Sequence[str] = ()) -> None:
    """Refuse a database whose sweep is not finished, or that lacks columns.

    Raises
    ------
    DatabaseError
        Says how many rows there are and what to do.
    """
    if len(database) < database.manifest.rows:
        raise DatabaseError(
            f"{database.store} has {len(database)} of {database.manifest.rows} rows; finish the sweep first, "
            "with the same command that began it"
        )
    for name in sorted(set(columns) - set(database.dataset("features").schema.names)):
        why = f"{database.store} lacks the column {name}; give a database that has it"
        raise DatabaseError(database.why_absent(name) or why)
