"""A signature as seen from one tooth: the pooled Wigner-Ville cells rolled so that this tooth comes first."""

from typing import Self

import numpy as np
from sklearn.base import BaseEstimator

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.rows.batch import CELLS, POINT, Batch, Column, Rows

COLUMNS: frozenset[Column] = frozenset({*POINT, CELLS})
"""Columns of a database's features that a view is made of."""

_BEFORE, _AFTER = 1, 4
_TINY = float(np.finfo(float).tiny)


class ToothViews(BaseEstimator):
    """Views of signatures from every tooth.

    A view holds the cells of the tooth passes from one before to four after the tooth, the mean cell of each band over
    the revolution, and speed and torque. So its length does not depend on the tooth count. Cells are scaled band by
    band with the median and the median deviation of the training rows, and compressed by arsinh.

    Parameters
    ----------
    columns
        Further columns of ``features``, the same for all teeth of a row. They are scaled and compressed like cells; the
        median stands for a number that is missing.

    Attributes
    ----------
    centre_, scale_
        (bands,) what is subtracted from the cells of a band, and what they are divided by.
    column_centre_, column_scale_
        (columns,) the same of the further columns.
    """

    columns: tuple[Column, ...] = ()

    def __init__(self, columns: tuple[Column, ...] = ()) -> None:
        self.columns = columns

    def fit(self, X: Rows) -> Self:
        """Learn the scale of each band.

        Parameters
        ----------
        X
            Rows with the columns ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``, and the further columns.
        """
        batch = Batch.from_rows(X, COLUMNS | frozenset(self.columns))
        cells = np.concatenate([flat.reshape(-1, flat.shape[1] // teeth) for teeth, _, flat in batch.cells()])
        self.centre_ = np.median(cells, axis=0)
        self.scale_ = 3 * np.median(np.abs(cells - self.centre_), axis=0).clip(min=np.finfo(float).tiny)
        if self.columns:
            values = self._values(batch)
            self.column_centre_ = np.nanmedian(values, axis=0)
            deviation = np.nanmedian(np.abs(values - self.column_centre_), axis=0)
            self.column_scale_ = np.where(deviation > 0, 3 * deviation, np.maximum(np.nanstd(values, axis=0), _TINY))
        return self

    def _values(self, batch: Batch) -> FloatArray:
        """Return the further columns, (rows, columns)."""
        return np.column_stack([batch.column(name) for name in self.columns])

    def views(self, batch: Batch) -> FloatArray:
        """Return the views of rows of one tooth count, (rows, teeth, features); entry t - 1 is seen from tooth t."""
        ((teeth, _, flat),) = batch.cells()
        cells = np.arcsinh((flat.reshape(len(batch), teeth, -1) - self.centre_) / self.scale_)
        offsets = np.arange(-_BEFORE, _AFTER + 1)
        seen = cells[:, (np.arange(teeth)[:, None] + offsets) % teeth].reshape(len(batch), teeth, -1)
        around = np.broadcast_to(cells.mean(axis=1)[:, None], (len(batch), teeth, cells.shape[2]))
        operating = np.column_stack(batch.operating_point()[:2])
        operating = np.broadcast_to(operating[:, None], (len(batch), teeth, 2))
        views = [seen, around, operating]
        if self.columns:
            scaled = np.arcsinh((self._values(batch) - self.column_centre_) / self.column_scale_)
            further = np.nan_to_num(scaled, nan=0.0)[:, None]
            views.append(np.broadcast_to(further, (len(batch), teeth, len(self.columns))))
        return np.concatenate(views, axis=2)

    def view_from(self, batch: Batch, tooth: IntArray) -> FloatArray:
        """Return the view of each row from a tooth of its own, numbered from 1; (rows, features)."""
        seen: list[FloatArray] = [np.empty(0)] * len(batch)
        for _, at in batch.by_teeth():
            views = self.views(batch.take(at))[np.arange(len(at)), tooth[at] - 1]
            for i, view in zip(at, views, strict=True):
                seen[i] = view
        return np.array(seen)
