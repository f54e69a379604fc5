"""A matrix as one column of a frame: a list of numbers for each row, kept in one piece."""

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import FloatArray


def matrix_column(matrix: FloatArray, index: pd.Index) -> pd.Series:
    """A matrix (rows, k) as a column of fixed-size lists.

    Python's own arrays, one a row, would take some hundred bytes a row beside their numbers.

    Examples
    --------
    >>> import numpy as np, pandas as pd
    >>> column = matrix_column(np.arange(6.0).reshape(3, 2), pd.Index([7, 8, 9]))
    >>> as_matrix(column[column.index > 7])
    array([[2., 3.],
           [4., 5.]])
    """
    lists = pa.FixedSizeListArray.from_arrays(pa.array(np.ascontiguousarray(matrix).ravel()), matrix.shape[1])
    return pd.Series(pd.arrays.ArrowExtensionArray(lists), index=index)


def as_matrix(column: pd.Series) -> FloatArray:
    """A column with a list of as many numbers in each row as a matrix (rows, k), float64."""
    if not isinstance(column.dtype, pd.ArrowDtype):
        return np.stack(column.to_list()).astype(float)
    lists = column.array.__arrow_array__()
    lists = lists.combine_chunks() if isinstance(lists, pa.ChunkedArray) else lists
    values = lists.flatten().to_numpy(zero_copy_only=False)
    return np.asarray(values, float).reshape(len(column), -1)
