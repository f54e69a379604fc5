"""Scales of TDMS channels: properties that state how raw numbers become physical ones."""

from collections.abc import Mapping

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.recording.files.formats.contents import StoredArray
from sigdb.recording.files.formats.tdms_segments import Properties

MOST_SCALES = 64
MOST_POINTS = 10_000
RAW_NUMBERS = 0xFFFFFFFF
"""Input of a scale that takes the raw numbers."""


class UnreadScaleError(InputError):
    """A channel has a scale that cannot be applied; the message completes "NAME has"."""


def scaled(raw: Mapping[int | None, StoredArray], levels: tuple[Properties, ...]) -> StoredArray:
    """Return the physical numbers of a channel.

    Parameters
    ----------
    raw
        Raw numbers by the scale that they belong to; by None where they are not of DAQmx.
    levels
        Properties of the channel, its group and the file; the first that states scales applies.

    Raises
    ------
    UnreadScaleError
        If a scale is of an unknown kind or not complete.
    """
    properties = next((level for level in levels if _count(level)), {})
    count = _count(properties)
    if not count or properties.get("NI_Scaling_Status", "unscaled") == "scaled":
        if len(raw) != 1:
            raise UnreadScaleError("raw numbers of several scales, but does not state them")
        return next(iter(raw.values()))
    if count > MOST_SCALES:
        raise UnreadScaleError(f"{count} scales")
    with np.errstate(over="ignore", invalid="ignore"):  # infinite numbers are refused with their place later
        return _Scales(properties, raw).output(count - 1)


def has_scales(levels: tuple[Properties, ...]) -> bool:
    """Return whether the properties of a channel, its group or the file state scales."""
    return any(_count(level) for level in levels)


def _count(properties: Properties) -> int:
    count = properties.get("NI_Number_Of_Scales")
    if isinstance(count, (int, float)):
        return int(count) if 0 <= count < 2**31 else 0
    return sum(name.startswith("NI_Scale[") and name.endswith("]_Scale_Type") for name in properties)


class _Scales:
    """Scales of a channel, each computed once; the input of a scale is one before it."""

    def __init__(self, properties: Properties, raw: Mapping[int | None, StoredArray]) -> None:
        self._properties, self._raw = properties, raw
        self._outputs: dict[int, StoredArray] = {}

    def output(self, i: int) -> StoredArray:
        if i not in self._outputs:
            self._outputs[i] = self._computed(i)
        return self._outputs[i]

    def _computed(self, i: int) -> StoredArray:
        kind = self._properties.get(f"NI_Scale[{i}]_Scale_Type")
        if kind is None:
            return self._raw_of(i)
        if kind == "Linear":
            return self._polynomial(i, "Linear", ["Linear_Y_Intercept", "Linear_Slope"])
        if kind == "Polynomial":
            size = self._size(f"NI_Scale[{i}]_Polynomial_Coefficients_Size", 4)
            return self._polynomial(i, "Polynomial", [f"Polynomial_Coefficients[{j}]" for j in range(size)])
        if kind == "Table":
            return self._table(i)
        if kind == "Add":
            return self._input(i, "Add_Left_Operand") + self._input(i, "Add_Right_Operand")
        if kind == "AdvancedAPI":
            return self._input(i, "AdvancedAPI")
        raise UnreadScaleError(f"a scale of kind {str(kind)[:40]!r}, which is not read; save it as scaled numbers")

    def _raw_of(self, i: int) -> StoredArray:
        """Return raw numbers: those of scale ``i`` of DAQmx, else the only ones."""
        raw = self._raw.get(i, self._raw.get(None))
        if raw is None:
            raise UnreadScaleError(f"no raw numbers for its scale {i}; save it as scaled numbers")
        return raw

    def _input(self, i: int, role: str) -> FloatArray:
        source = self._properties.get(f"NI_Scale[{i}]_{role}_Input_Source", RAW_NUMBERS if i == 0 else None)
        if source == RAW_NUMBERS and len(self._raw) == 1:
            values = next(iter(self._raw.values()))
        elif isinstance(source, int) and 0 <= source < i:
            values = self.output(source)
        else:
            raise UnreadScaleError(f"a scale {i} without its input; save it as scaled numbers")
        return np.asarray(values, dtype=float)

    def _polynomial(self, i: int, role: str, keys: list[str]) -> FloatArray:
        coefficients = self._numbers([f"NI_Scale[{i}]_{key}" for key in keys], i)
        return np.asarray(np.polynomial.polynomial.polyval(self._input(i, role), coefficients))

    def _table(self, i: int) -> FloatArray:
        """Return values on the straight lines between the points of a table; beyond them, nothing is known."""
        prefix = f"NI_Scale[{i}]_Table"
        size = self._size(f"{prefix}_Pre_Scaled_Values_Size", 0)
        if self._size(f"{prefix}_Scaled_Values_Size", size) != size:
            raise UnreadScaleError("a table with columns of different lengths; save it as scaled numbers")
        x = self._numbers([f"{prefix}_Pre_Scaled_Values[{j}]" for j in range(size)], i)
        y = self._numbers([f"{prefix}_Scaled_Values[{j}]" for j in range(size)], i)
        if size > 1 and x[0] > x[-1]:
            x, y = x[::-1], y[::-1]
        if not (np.diff(x) > 0).all():
            raise UnreadScaleError("a table that does not rise; save it as scaled numbers")
        return np.interp(self._input(i, "Table"), x, y)

    def _size(self, key: str, default: int) -> int:
        size = self._properties.get(key, default)
        return size if isinstance(size, int) and 0 < size <= MOST_POINTS else 0

    def _numbers(self, keys: list[str], i: int) -> FloatArray:
        values = [self._properties.get(key) for key in keys]
        if not keys or not all(isinstance(value, (int, float)) and np.isfinite(value) for value in values):
            raise UnreadScaleError(f"a scale {i} that is not complete; save it as scaled numbers")
        return np.array(values, dtype=float)
