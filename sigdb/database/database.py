"""A database that is read: SQL, cases, features, signals, templates, match, export."""

from collections.abc import Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, IntArray, plain_array
from sigdb.database.export.export import Export, export_database
from sigdb.database.limits import LimitOptions, QueryLimits
from sigdb.database.matching.match import Match, Matcher
from sigdb.database.open_tables.delta_log import register_delta
from sigdb.database.open_tables.iceberg import register_iceberg
from sigdb.database.open_tables.registered_files import OpenTable
from sigdb.database.queried_tables import QueriedTables
from sigdb.database.signals import row_matrices
from sigdb.database.store.schema import suffixed

if TYPE_CHECKING:
    from sigdb.database.splits.learning_set import LearningSet


class Database(QueriedTables):
    """A database that is read; :func:`sigdb.open` opens it.

    Readers follow receipts, so that a sweep may go on writing: a reader sees the parts that were finished when it
    opened the database. Several threads may use one object at the same time. Used with ``with``, or closed by
    :meth:`close`, it ends queries whose batches are read in part only; else the end of the process does.

    Parameters
    ----------
    location : str, path-like or Store
        Directory or URI of the database.
    """

    def __repr__(self) -> str:
        return f"Database({str(self.store)!r}, {self.lacks or f'{len(self)} of {len(self)} rows'})"

    def xy(
        self,
        target: str,
        *,
        split: str = "",
        columns: Sequence[str] = (),
        folds: int = 5,
        allow_leak: bool = False,
    ) -> "LearningSet":
        """Return inputs, labels, groups and folds without leaks, for an estimator of scikit-learn.

        Columns of a database have roles: a model may read those that a measurement has too (``input``). Others are the
        damage (``label``), the origin of a row (``id``), or numbers that only a simulation has (``truth``).

        Parameters
        ----------
        target : {"location", "detection", "kind", "severity"}
            Question to answer.
        split : str, optional
            Name of the split; see :func:`sigdb.database.make_split`. S1 if left out, of recordings ``recording``.
        columns : sequence of str, optional
            Input columns of ``features`` or ``signals``, such as ``"tsa"``; all of ``features`` if left out.
        folds : int
            Folds of specimens.
        allow_leak : bool
            Whether the split ``random`` of recordings may be made.

        Returns
        -------
        LearningSet
            ``X``, ``y``, ``groups`` and ``cv``.

        Raises
        ------
        InputError
            If target, split or a column does not exist, a column is no input, or the rows cannot be split so.
        DatabaseError
            If the sweep is not finished, or a part is damaged.

        Examples
        --------
        ::

            from sklearn.ensemble import RandomForestClassifier
            from sklearn.model_selection import cross_val_score

            X, y, groups, cv = sigdb.open("signatures").xy("location", split="S1")
            cross_val_score(RandomForestClassifier(), X, y, cv=cv)
        """
        from sigdb.database.splits.learning_set import learning_set  # imports scikit-learn, and this module

        return learning_set(self, target, split=split, columns=columns, folds=folds, allow_leak=allow_leak)

    def templates(self) -> pd.DataFrame:
        """Return the templates, each distinct case once.

        Where the rig turns exactly, the damage of a template is at tooth 1. Else each damaged tooth has its own
        template.

        Returns
        -------
        pandas.DataFrame
            One row a template.

        Raises
        ------
        DatabaseError
            If a part is damaged.
        """
        with self._reading():
            templates: pd.DataFrame = self.dataset("templates").to_table().to_pandas()
        return templates

    def signals(self, ids: ArrayLike, *, sensor: str | None = None) -> dict[str, FloatArray]:
        """Return averaged signals and order spectra of rows, which are located by arithmetic on their ids.

        Parameters
        ----------
        ids : array_like of int, (k,)
            Ids of rows.
        sensor : str, optional
            Name of a stored sensor; the first one if left out.

        Returns
        -------
        dict
            ``tsa`` (k, n) and ``spectrum`` (k, n // 2 + 1), float32, in the order of ``ids``. Rows without a result
            are nan.

        Raises
        ------
        InputError
            If the database lacks an id or the sensor, or the rows have different lengths (other tooth counts).
        DatabaseError
            If a part is damaged.
        """
        wanted = np.atleast_1d(plain_array("signals", "ids", ids))
        if wanted.size and wanted.dtype.kind not in "iu":
            raise InputError(f"ids must be whole numbers, not {wanted.dtype} such as {wanted.flat[0]}")
        wanted = wanted.astype(np.int64)
        columns = self._sensor_columns(sensor)
        matrices = row_matrices(self._signal_lists(wanted, columns), wanted.size)
        if not matrices:  # none of the rows has a result, so none has a length
            n = self._samples(wanted)
            widths = {"tsa": n, "spectrum": n // 2 + 1 if n else 0}
            return {key: np.full((wanted.size, width), np.nan, np.float32) for key, width in widths.items()}
        return matrices

    def lists(self, ids: IntArray, columns: Sequence[str]) -> dict[str, FloatArray]:
        """Return list columns of ``signals`` of rows as matrices (rows, n), float32, in the order of the ids.

        Parameters
        ----------
        ids
            (k,) ids, in any order.
        columns
            Names of the columns.

        Returns
        -------
        dict
            Matrices by column; empty if no row has a result. Rows without one are nan.

        Raises
        ------
        InputError
            If the database lacks an id, or the rows have different lengths.
        DatabaseError
            If a part is damaged.
        """
        return row_matrices(self._signal_lists(ids, {name: name for name in columns}), ids.size)

    def _samples(self, ids: IntArray) -> int:
        """Samples of the first row by its tooth count."""
        if not ids.size:
            return 0
        teeth = self.sql(f"select teeth from cases where id = {ids[0]}")["teeth"].iloc[0]
        return int(teeth) * int(self.manifest.resolved["signature"]["samples_per_tooth"])

    def _sensor_columns(self, sensor: str | None) -> dict[str, str]:
        return {key: suffixed(key, self.sensors, self.stored_sensor(sensor)) for key in ("tsa", "spectrum")}

    def unit(self, column: str, sensor: str | None = None) -> str:
        """Return the unit of a sensor's column of signals.

        Parameters
        ----------
        column : {"tsa", "spectrum"}
            Name of the column.
        sensor : str, optional
            Name of a stored sensor; the first one if left out.

        Returns
        -------
        str
            The unit, for example ``"m/s^2"``.
        """
        field = self.dataset("signals").schema.field(self._sensor_columns(sensor)[column])
        return str(field.metadata[b"unit"].decode())

    @cached_property
    def _matcher(self) -> Matcher:
        return Matcher(self)

    def match(
        self,
        tsa: ArrayLike,
        *,
        k: int = 10,
        sensor: str | None = None,
        turns: ArrayLike | None = None,
        where: str | None = None,
        **limits: Unpack[LimitOptions],
    ) -> Match:
        """Return the templates nearest to an average, over all turns.

        The average and the clean average of each template are divided by their standard deviations over the revolution
        and freed of their mean, mesh harmonics and shaft orders 1 and 2 (:func:`sigdb.signature.residual_signal`). Let
        z and z_t be these residuals. The residual distance is the root mean square of ``z - z_t turned``. The match is
        the overlap ``<z, z_t turned> / (|z| |z_t|)``. Both are taken at the turn where they are best.

        In a database of recordings, rows with a result take the place of templates: ``id`` that of ``template``.

        Templates are ranked by residual distance: under white noise the nearest one is the most likely. The healthy
        template, whose residual and match are 0, takes part on equal terms. Only templates of the average's length
        take part, so of its tooth count.

        Parameters
        ----------
        tsa : array_like, (n,)
            Average of one revolution of the shaft, in any unit; ``samples_per_tooth`` samples a tooth.
        k : int
            Number of templates to return; fewer if there are fewer.
        sensor : str, optional
            Name of a stored sensor; the first one if left out.
        turns : array_like, optional
            Turns to try, in teeth; all samples if left out. Examples are ``range(12)`` where the tacho mark is
            certain, and 0 where it is certain and the rig does not turn exactly.
        where : str, optional
            A condition that templates must meet: one SQL expression on their columns, for example ``"torque > 100"``.
        **limits
            Limits of that condition, as in :meth:`cases`.

        Returns
        -------
        Match
            ``table``, a frame of k rows with the case of each template and the columns:

            - ``template``: id of the template;
            - ``tooth``: first damaged tooth of the turned template, 0 for none;
            - ``turn``: teeth by which the template is turned later;
            - ``match`` and ``residual_distance``;
            - ``outside``: whether the residual distance is above the threshold of ``sigdb coverage``; missing without a
              threshold.

            ``outside`` and ``threshold`` of the result hold for the signature as a whole.

        Raises
        ------
        InputError
            If the average is not one row of finite numbers that vary, or no template has its length or meets ``where``.
        DatabaseError
            If a part is damaged.

        Notes
        -----
        Spectra of the templates are kept in the user's cache directory, or in that which ``SIGDB_CACHE`` names.
        """
        return self._matcher.match(tsa, k=k, sensor=sensor, turns=turns, where=where, limits=QueryLimits(**limits))

    def export(
        self,
        path: str | Path,
        *,
        where: str | None = None,
        signals: bool = True,
        sensor: str | None = None,
        **limits: Unpack[LimitOptions],
    ) -> Export:
        """Write rows to a file that MATLAB reads, a MAT-file (``.mat``) or HDF5 (``.h5``, ``.hdf5``).

        Columns without lists are column vectors in ``cases``: numbers as doubles, nan where there is none, text as
        cells. Averages, spectra and Wigner-Ville features are single matrices, one row a signature, padded with nan
        where tooth counts differ. Characters of a column's name that MATLAB does not take become ``_``. Units,
        descriptions and formulas are structs in a MAT-file and attributes in HDF5. In MATLAB, ``h5read`` returns an
        HDF5 matrix transposed: one column a signature.

        HDF5 is written batch by batch, so that a database larger than memory can be exported. A MAT-file is composed
        in memory.

        Parameters
        ----------
        path : str or path-like
            The file; an old one is replaced when the new one is whole.
        where : str, optional
            As in :meth:`cases`; all rows if left out.
        signals : bool
            Whether averages and spectra are written.
        sensor : str, optional
            Only the columns of this sensor, without suffix; of all sensors if left out.
        **limits
            ``max_seconds`` and ``max_memory_gb`` of finding and reading the rows, as in :meth:`sql`; their number is
            not limited.

        Returns
        -------
        Export
            ``path``, and the numbers of ``rows`` and ``columns`` in it.

        Raises
        ------
        InputError
            If the file has another suffix, ``where`` or ``sensor`` name a thing that does not exist, a limit is
            reached, a variable is too large for a MAT-file, or h5py is not installed.
        DatabaseError
            If a part is damaged; then no file is written.
        """
        return export_database(self, path, where=where, signals=signals, sensor=sensor, **limits)

    def register_delta(self) -> tuple[OpenTable, ...]:
        """Register the Parquet files as Delta tables, whose logs lie in their folders; no file is written again.

        The finished parts of ``features``, ``signals`` and ``templates`` are a table each, in the folder of that name.
        The log names files by their paths below the folder, so that it moves along with the database. Added features
        are not registered.

        Returns
        -------
        tuple of OpenTable
            The tables. One whose files have not changed since its registration stays as it is.

        Raises
        ------
        InputError
            If the database lies in an object store, nothing of it is finished, or deltalake is not installed.
        """
        return register_delta(self)

    def register_iceberg(self, catalog: str, *, namespace: str | None = None) -> tuple[OpenTable, ...]:
        """Register the Parquet files as tables of an Apache Iceberg catalog; no file is written again.

        The tables are those of :meth:`register_delta`. Iceberg's metadata lie in folders ``metadata`` of the tables and
        hold full paths: a database that was moved must be registered again.

        Parameters
        ----------
        catalog : str
            Name of a catalog in pyiceberg's configuration, or a SQLite file, whose name ends in ``.db``, ``.sqlite``
            or ``.sqlite3``. It is made if it does not exist.
        namespace : str, optional
            Namespace of the tables; the name of the database's folder if left out.

        Returns
        -------
        tuple of OpenTable
            The tables. One whose files have not changed since its registration stays as it is.

        Raises
        ------
        InputError
            As :meth:`register_delta`; if the catalog cannot be opened, or has other tables of these names.
        """
        return register_iceberg(self, catalog, namespace=namespace)


def open(location: str | PathLike[str]) -> Database:
    """Open a database for reading.

    Parameters
    ----------
    location : str or path-like
        The directory that a sweep wrote, or its place in an object store: ``s3://bucket/prefix``.

    Returns
    -------
    Database
        Its finished parts.

    Raises
    ------
    InputError
        If there is no database.
    DatabaseError
        If its receipts and files do not agree.
    """
    return Database(location)
