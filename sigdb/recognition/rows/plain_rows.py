"""Rows of plain arrays, as a measurement has them, in place of rows of a database."""

from collections.abc import Collection
from typing import Any, TypedDict

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, plain_array, suggestion
from sigdb.recognition.rows.batch import CELLS, NOISE, Batch, Column
from sigdb.signature import features


class PlainRow(TypedDict, total=False):
    """Averages and their numbers, one or more rows; see :meth:`Model.predict`."""

    tsa: ArrayLike
    speed_rpm: ArrayLike
    torque: ArrayLike
    averages: ArrayLike
    scatter: ArrayLike
    noise: ArrayLike
    teeth: int
    unit: str
    sensor: str


_NUMBERS = ("speed_rpm", "torque", *NOISE)
_LEAST = {"averages": 1, "scatter": 0}

_GREATEST = 1e60
"""Greatest number of a row: sums of fourth powers stay below the greatest float."""


def plain_rows(
    row: PlainRow, *, reads: Collection[Column], teeth: tuple[int, ...], unit: str | None, sensor: str
) -> Batch:
    """Return averages and their numbers as a batch.

    Parameters
    ----------
    row
        The arrays.
    reads
        Columns that are read; the numbers of the noise may be missing where they are not read.
    teeth
        Tooth counts of the model; the only one is taken where ``row`` states none.
    unit, sensor
        Unit and sensor of the model, which ``row`` may state and must not contradict; the unit may be unknown.

    Raises
    ------
    InputError
        If an argument is unknown, missing, or is no array of finite numbers of the right shape.
    """
    arguments: dict[str, Any] = {**row}
    for name in arguments:
        if name not in PlainRow.__annotations__:
            raise InputError(f"predict has no argument {name!r}{suggestion(name, PlainRow.__annotations__)}")
    needed = ("tsa", "speed_rpm", "torque", *(name for name in NOISE if name in reads))
    lacking = [name for name in needed if name not in row]
    if lacking:
        raise InputError(f"{', '.join(lacking)} is missing; give rows, or {', '.join(needed)} by name")
    for name, trained in (("unit", unit), ("sensor", sensor)):
        stated = arguments.get(name)
        if trained and stated is not None and stated != trained:
            raise InputError(f"{name} = {stated!r}, and the model was trained on {trained!r}; convert, or leave it out")
    count = row.get("teeth", teeth[0] if len(teeth) == 1 else None)
    if count is None:
        raise InputError("teeth is missing: the model does not belong to one tooth count; give teeth")
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise InputError(f"teeth = {count!r} must be a whole number above 0")
    x = np.atleast_2d(_numbers("tsa", row["tsa"]))
    if x.ndim != 2 or not x.size:
        raise InputError(f"tsa has shape {x.shape}; give one average (n,), or (rows, n)")
    table = pd.DataFrame({"teeth": np.full(len(x), int(count))})
    for name in _NUMBERS:
        if name in row:
            values = _numbers(name, arguments[name])
            if values.ndim > 1 or values.size not in (1, len(x)):
                raise InputError(f"{name} has shape {values.shape}; give a number, or one for each of {len(x)} rows")
            if values.size and values.min() < _LEAST.get(name, -np.inf):
                raise InputError(f"{name} = {values.min():g} must be at least {_LEAST[name]}; check it")
            table[name] = np.broadcast_to(values.ravel(), len(x))
    by_order = {int(count): _by_order(row["noise"], x)} if "noise" in row else None
    cells = {}
    if CELLS in reads:
        pooled = features(x, teeth=int(count), names=[CELLS])[CELLS]
        cells = {int(count): pooled.reshape(len(x), -1)}
    return Batch(table=table, tsa={int(count): x}, features=cells or None, noise_by_order=by_order)


def _by_order(values: ArrayLike, x: FloatArray) -> FloatArray:
    """Return the noise of averages (rows, n) by order, (rows, n / 2 + 1)."""
    noise = np.atleast_2d(_numbers("noise", values))
    orders = x.shape[1] // 2 + 1
    if noise.ndim != 2 or noise.shape[1] != orders or len(noise) not in (1, len(x)):
        raise InputError(
            f"noise has shape {noise.shape}; give it at orders 0 to {orders - 1}, once or for each average"
        )
    if noise.min() < 0 or not noise.any(axis=1).all():
        raise InputError("noise must be at least 0, and above 0 at some order; check it")
    return np.broadcast_to(noise, (len(x), orders))


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    stored = plain_array("predict", name, values)
    if stored.dtype.kind == "c":
        raise InputError(f"{name} must be real, not {stored.dtype}; pass its real part")
    try:
        array: FloatArray = stored.astype(float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} must be numbers, not {type(values).__name__}; give one number or an array") from None
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite; leave out what is nan or inf")
    if array.size and np.abs(array).max() > _GREATEST:
        raise InputError(f"{name} has a value of {np.abs(array).max():g}; give it in the unit of the model")
    return array
