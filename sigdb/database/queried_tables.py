"""Tables of a database that are queried: by SQL, or by a condition on rows."""

from typing import Unpack

import pandas as pd
import pyarrow as pa

from sigdb.database.limits import LimitOptions, QueryLimits
from sigdb.database.query import check_row_count
from sigdb.database.stored_tables import StoredTables
from sigdb.database.virtual.query_cost import CostRecord, QueryCost


class QueriedTables(StoredTables):
    """The finished parts of a database, with queries."""

    def sql(self, query: str, **limits: Unpack[LimitOptions]) -> pd.DataFrame:
        """Run one SELECT statement.

        The views are ``features`` (all columns of a row), ``cases`` (the same without lists), ``signals`` (``id``,
        ``tsa``, ``spectrum``) and ``templates``.

        Parameters
        ----------
        query : str
            One SELECT statement in DuckDB's SQL. It reads no file and changes nothing.
        **limits
            ``max_seconds`` (600), ``max_memory_gb`` (4) and ``max_rows`` (10 000 000): a query that reaches one of them
            is refused. Nothing is written to a disk in place of memory, which all queries of a database share.

        Returns
        -------
        pandas.DataFrame
            The result.

        Raises
        ------
        InputError
            If the text is not one SELECT statement, names a thing that does not exist, or reaches a limit.
        DatabaseError
            If a part that it reads is damaged.
        """
        result: pd.DataFrame = self.arrow(query, **limits).to_pandas()
        return result

    def arrow(self, query: str, **limits: Unpack[LimitOptions]) -> pa.Table:
        """Run one SELECT statement and return the result as an Arrow table.

        Parameters
        ----------
        query : str
            As in :meth:`sql`.
        **limits
            As in :meth:`sql`.

        Returns
        -------
        pyarrow.Table
            The result.

        Raises
        ------
        InputError, DatabaseError
            As :meth:`sql`.
        """
        with self._reading(), self.connect(limits=QueryLimits(**limits)) as connection:
            return connection.select(query)

    def cost(self, query: str) -> QueryCost:
        """Return which virtual rows and columns a statement would make, without making any.

        Rows that a condition on planned columns rules out are not made, as far as whole blocks of 256 rows have none.
        Where a statement joins tables, what one side leaves out of the other is not foreseen.

        Parameters
        ----------
        query : str
            As in :meth:`sql`.

        Returns
        -------
        QueryCost
            Rows, columns, and the time that they take at most.

        Raises
        ------
        InputError
            If the text is not one SELECT statement, or names a thing that does not exist.
        DatabaseError
            If a part is damaged.
        """
        record = CostRecord()
        if self.virtual_rows:
            with self._reading(), self.cost_connection(record) as connection:
                connection.select(query)
        return QueryCost(record.rows, self.virtual_rows, tuple(record.columns), record.seconds)

    def stream(self, query: str, *, rows: int = 2048, **limits: Unpack[LimitOptions]) -> pa.RecordBatchReader:
        """Run one SELECT statement and return the result in batches, as DuckDB computes them.

        A statement that needs all rows before the first one, such as one that sorts, holds its result in memory.

        Parameters
        ----------
        query : str
            As in :meth:`sql`.
        rows : int
            Greatest number of rows in a batch.
        **limits
            As in :meth:`sql`. The time is that in which batches are computed, not that between them. Memory is that of
            the computation.

        Returns
        -------
        pyarrow.RecordBatchReader
            An iterator of record batches.

        Raises
        ------
        InputError, DatabaseError
            As :meth:`sql`. Damage is raised when the stream comes to it.
        """
        check_row_count(rows)
        with self._reading():
            return self.connect(limits=QueryLimits(**limits)).stream(query, rows)

    def cases(self, where: str | None = None, **limits: Unpack[LimitOptions]) -> pd.DataFrame:
        """Return rows without their lists: parameters, labels and indicators, in the order of their ids.

        Parameters
        ----------
        where : str, optional
            One SQL expression, for example ``"tooth = 6 and stiffness_loss >= 0.25"``; all rows if left out. It is
            parsed as an expression, so that no second statement can stand behind it. It may hold subqueries over the
            views.
        **limits
            ``max_seconds`` and ``max_memory_gb``, as in :meth:`sql`.

        Returns
        -------
        pandas.DataFrame
            One row a row of the database.

        Raises
        ------
        InputError
            If ``where`` is not one expression, names a thing that does not exist, or reaches a limit.
        DatabaseError
            If a part is damaged.
        """
        return self._rows("cases", where, QueryLimits(**limits))

    def features(self, where: str | None = None, **limits: Unpack[LimitOptions]) -> pd.DataFrame:
        """Return rows with their pooled Wigner-Ville features, in the order of their ids.

        Parameters
        ----------
        where : str, optional
            As in :meth:`cases`.
        **limits
            As in :meth:`cases`.

        Returns
        -------
        pandas.DataFrame
            One row a row of the database.

        Raises
        ------
        InputError, DatabaseError
            As :meth:`cases`.
        """
        return self._rows("features", where, QueryLimits(**limits))

    def _rows(self, view: str, where: str | None, limits: QueryLimits) -> pd.DataFrame:
        with self._reading(), self.connect(limits=limits) as connection:
            rows: pd.DataFrame = connection.choose(view, where).to_pandas()
        return rows
