"""Array types, and arrays of callers: masked values are refused, since their numbers stand for nothing."""

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sigdb.core.errors import InputError

FloatArray = NDArray[np.floating[Any]]
ComplexArray = NDArray[np.complexfloating[Any, Any]]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def plain_array(owner: str, name: str, values: object, dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return values as an array without a mask.

    NumPy's own conversion drops a mask, so that the numbers below it count as measured ones.

    Parameters
    ----------
    owner, name
        Function and argument, for messages; the function may be empty.
    values
        An array, or a sequence that NumPy takes for one. A masked array is accepted where nothing is masked.
    dtype
        Type of the result; that of the values if left out.

    Raises
    ------
    InputError
        If a value is masked, or the values are no array.

    Examples
    --------
    >>> import numpy as np
    >>> plain_array("rms", "tsa", np.ma.masked_array([1.0, 2.0])).tolist()
    [1.0, 2.0]
    >>> plain_array("rms", "tsa", np.ma.masked_greater([1.0, 9.0], 5.0))
    Traceback (most recent call last):
    ...
    sigdb.core.errors.InputError: rms: tsa has 1 masked value, and a mask is not a number; fill it, or leave it out
    """
    check_unmasked(owner, name, values)
    try:
        return np.asarray(values, dtype)
    except (TypeError, ValueError, OverflowError) as error:
        where = f"{owner}: {name}" if owner else name
        why = str(error).splitlines()[0].split(". ")[0]
        raise InputError(f"{where} is no array of numbers ({why}); give numbers, in lists of equal length") from None


def check_unmasked(owner: str, name: str, values: object) -> None:
    """Refuse masked values, in an array or in sequences of arrays.

    Raises
    ------
    InputError
        If a value is masked.
    """
    masked = _masked(values)
    if masked:
        where = f"{owner}: {name}" if owner else name
        what, them = ("value", "it") if masked == 1 else ("values", "them")
        raise InputError(
            f"{where} has {masked} masked {what}, and a mask is not a number; fill {them}, or leave {them} out"
        )


def _masked(values: object) -> int:
    if isinstance(values, np.ma.MaskedArray):
        return int(np.ma.getmaskarray(values).sum())
    if isinstance(values, np.ndarray) and values.dtype == object:
        return sum(_masked(value) for value in values.flat)
    if isinstance(values, list | tuple):
        return sum(_masked(value) for value in values if isinstance(value, list | tuple | np.ndarray))
    return 0
