"""Unit: arrays of callers are refused where a value is masked, wherever the masked array stands."""

import numpy as np
import pytest

from sigdb.core import InputError, plain_array

MASKED = np.ma.masked_array([1.0, 2.0, 3.0], mask=[False, True, True])
OPEN = np.ma.masked_array([1.0, 2.0])
BOXED = np.array([None, MASKED], dtype=object)


@pytest.mark.parametrize(
    ("values", "count"),
    [
        (MASKED, "2 masked values"),
        (MASKED[:2], "1 masked value,"),
        ([OPEN, MASKED], "2 masked values"),
        ((1.0, [MASKED]), "2 masked values"),
        ([1.0, np.ma.masked], "1 masked value,"),
        (BOXED, "2 masked values"),
    ],
    ids=["array", "one", "list", "nested", "constant", "objects"],
)
def test_masked_values_are_counted_and_refused(values, count):
    with pytest.raises(InputError, match=f"^rms: tsa has {count}"):
        plain_array("rms", "tsa", values)


@pytest.mark.parametrize("values", [OPEN, [OPEN, OPEN], [1, 2], np.arange(3.0), 4.0, "text"])
def test_all_else_is_converted_as_numpy_does(values):
    found = plain_array("rms", "tsa", values)
    assert type(found) is np.ndarray
    np.testing.assert_array_equal(found, np.asarray(values))


def test_numpy_itself_drops_the_mask():
    """The reason for the check."""
    assert np.asarray(MASKED).tolist() == [1.0, 2.0, 3.0]
