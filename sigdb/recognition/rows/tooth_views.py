"""A signature as seen from one tooth: the pooled Wigner-Ville cells rolled so that this tooth comes first."""

from collections.abc import Iterator
from typing import Self

import numpy as np
import pandas as pd
from sklearn.base import BaseEstimator

from sigdb.core import FloatArray, InputError, IntArray

COLUMNS = ("teeth", "speed_rpm", "torque", "wigner_ville")
"""Columns of a database's features that a view is made of."""

_BEFORE, _AFTER = 1, 4


class ToothViews(BaseEstimator):
    """Views of signatures from every tooth.

    A view holds the cells of the tooth passes from one before to four after the tooth, the mean cell of each band over
    the revolution, and speed and torque: its length does not depend on the tooth count. Cells are scaled band by band
    with the median and the median deviation of the training rows, and compressed by arsinh.
    """

    def fit(self, X: pd.DataFrame) -> Self:
        """Learn the scale of each band.

        Parameters
        ----------
        X
            Rows with the columns ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``.
        """
        check_columns(X)
        cells = np.concatenate([_cells(part).reshape(-1, _bands(part)) for _, part in X.groupby("teeth")])
        self.centre_ = np.median(cells, axis=0)
        self.scale_ = 3 * np.median(np.abs(cells - self.centre_), axis=0).clip(min=np.finfo(float).tiny)
        return self

    def views(self, X: pd.DataFrame, teeth: int) -> FloatArray:
        """(rows, teeth, features) views of rows that all have this tooth count; entry t - 1 is seen from tooth t."""
        cells = np.arcsinh((_cells(X) - self.centre_) / self.scale_)
        offsets = np.arange(-_BEFORE, _AFTER + 1)
        seen = cells[:, (np.arange(teeth)[:, None] + offsets) % teeth].reshape(len(X), teeth, -1)
        around = np.broadcast_to(cells.mean(axis=1)[:, None], (len(X), teeth, cells.shape[2]))
        operating = X[["speed_rpm", "torque"]].to_numpy(float)
        operating = np.broadcast_to(operating[:, None], (len(X), teeth, 2))
        return np.concatenate([seen, around, operating], axis=2)

    def view_from(self, X: pd.DataFrame, tooth: IntArray) -> FloatArray:
        """(rows, features) each row's view from a tooth of its own, numbered from 1."""
        seen: list[FloatArray] = [np.empty(0)] * len(X)
        for teeth, at in by_teeth(X):
            views = self.views(X.iloc[at], teeth)[np.arange(len(at)), tooth[at] - 1]
            for i, view in zip(at, views, strict=True):
                seen[i] = view
        return np.array(seen)


def by_teeth(X: pd.DataFrame) -> list[tuple[int, IntArray]]:
    """Tooth counts with the positions of their rows."""
    teeth = X["teeth"].to_numpy()
    return [(int(count), np.flatnonzero(teeth == count)) for count in np.unique(teeth)]


def check_columns(X: pd.DataFrame) -> None:
    """Refuse input that is not rows of features.

    Raises
    ------
    InputError
        Names the columns that are missing, or says that a row has no result.
    """
    lacking = [name for name in COLUMNS if not hasattr(X, "columns") or name not in X.columns]
    if lacking:
        raise InputError(f"X lacks the columns {lacking}; give rows as Database.features() returns them")
    if X.empty:
        raise InputError("X has no rows; give at least one")
    if X["wigner_ville"].isna().any():
        raise InputError("X has rows without a result; keep rows whose status is 'ok'")


def _cells(X: pd.DataFrame) -> FloatArray:
    lengths, teeth = {len(row) for row in X["wigner_ville"]}, int(X["teeth"].iloc[0])
    if len(lengths) > 1 or min(lengths) % teeth:
        raise InputError(
            f"wigner_ville holds {sorted(lengths)} cells, which do not fit {teeth} teeth and as many bands each"
        )
    flat = np.stack(X["wigner_ville"].to_list()).astype(float)
    return flat.reshape(len(X), int(X["teeth"].iloc[0]), -1)


def _bands(X: pd.DataFrame) -> int:
    return len(X["wigner_ville"].iloc[0]) // int(X["teeth"].iloc[0])


def averages_by_teeth(X: pd.DataFrame) -> Iterator[tuple[int, IntArray, FloatArray]]:
    """Tooth counts, places of their rows, and their averages (rows, n).

    Raises
    ------
    InputError
        If the rows have no averages, or those of one tooth count differ in length.
    """
    if "tsa" not in X:
        raise InputError("X lacks the column 'tsa'; give rows of Database.features() with tsa of Database.signals()")
    tsa = X["tsa"].to_numpy()
    for teeth, at in by_teeth(X):
        lengths = sorted({np.size(one) for one in tsa[at]})
        if len(lengths) > 1 or lengths[0] % teeth:
            raise InputError(
                f"tsa of gears of {teeth} teeth has {lengths} samples; give averages of one length, as many samples a "
                "tooth pass each"
            )
        yield teeth, at, np.stack(list(tsa[at])).astype(float)
