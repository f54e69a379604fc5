"""The stored templates of a database that is being made, read row group by row group."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sigdb.core import FloatArray
from sigdb.database import ROW_GROUP, Store, open_checked, read_receipt, suffixed
from sigdb.sweep.plan.plan import PART_TEMPLATES

_FILES_KEPT, _GROUPS_KEPT, _TEMPLATES_KEPT = 4, 2, 16


@dataclass(frozen=True, kw_only=True)
class Template:
    """A stored template; without arrays where its status says why.

    Attributes
    ----------
    status
        ``ok``, or why there is no result.
    min_compression
        Least compression as a fraction of the static one; nan where it is not known.
    compression, compression_response
        (N,) and (N, teeth), as fractions of the static compression, over the common period of all meshes.
    signals, specimen_response
        (sensors, n) y_D and (sensors, n, teeth) Y_D.
    compression_harmonic, harmonic_response, orders
        (N, orders, 2) and (sensors, n, orders, 2) under harmonic excitations, and their orders.
    tooth
        First damaged tooth, 0 for none.
    least_elsewhere
        Least compression of meshes other than the damaged gear's, as a fraction of their static ones.
    reference_variance
        (sensors,) variance of the healthy clean average.
    contact_loss
        Whether the mesh loses contact: then it holds for gears without index errors, and has no responses to them;
        None where it is not known.
    """

    status: str
    tooth: int
    min_compression: float
    least_elsewhere: float
    compression: FloatArray
    compression_response: FloatArray
    signals: FloatArray
    specimen_response: FloatArray
    compression_harmonic: FloatArray
    harmonic_response: FloatArray
    orders: FloatArray
    reference_variance: FloatArray
    contact_loss: bool | None


class TemplateReader:
    """Templates by number. Rows ask for them in order, so few are kept, and few of their row groups."""

    def __init__(self, store: Store, sensors: Sequence[str]) -> None:
        self._store, self._sensors = store, sensors
        self._file = lru_cache(_FILES_KEPT)(self._opened)
        self._group = lru_cache(_GROUPS_KEPT)(self._read)
        self._template = lru_cache(_TEMPLATES_KEPT)(self._made)

    def __getitem__(self, number: int) -> Template:
        return self._template(number)

    def _opened(self, part: int) -> pq.ParquetFile:
        record = read_receipt(self._store, "templates", part).file("templates")
        return pq.ParquetFile(open_checked(self._store, record))

    def _read(self, part: int, group: int) -> pa.Table:
        return self._file(part).read_row_group(group)

    def _made(self, number: int) -> Template:
        part, within = divmod(number, PART_TEMPLATES)
        group, row = divmod(within, ROW_GROUP["templates"])
        stored = self._group(part, group).slice(row, 1)
        return _template(
            {name: column[0] for name, column in zip(stored.column_names, stored, strict=True)}, self._sensors
        )


def _template(row: Mapping[str, pa.Scalar], sensors: Sequence[str]) -> Template:
    """A template of a stored row."""
    none = np.empty(0)

    def number(name: str) -> float:
        return float(row[name].as_py() if row[name].is_valid else np.nan)

    def array(name: str) -> FloatArray:
        return row[name].values.to_numpy().astype(float) if row[name].is_valid else none

    def each_sensor(name: str) -> FloatArray:
        return np.array([array(suffixed(name, sensors, sensor)) for sensor in sensors])

    static, teeth, orders = number("static_compression"), row["teeth"].as_py(), array("orders")
    # Those that lost contact, and those without a result, have no responses.
    signals, compression = each_sensor("tsa"), array("compression") / static
    s, n, N = *signals.shape, len(compression)

    def response(values: FloatArray, *shape: int) -> FloatArray:
        return values.reshape(shape) if values.size else np.zeros(shape)

    return Template(
        status=row["status"].as_py(),
        tooth=row["tooth"].as_py(),
        min_compression=number("min_compression"),
        least_elsewhere=number("least_elsewhere"),
        compression=compression,
        compression_response=response(array("compression_response") / static, N, teeth),
        signals=signals,
        specimen_response=response(each_sensor("specimen_response"), s, n, teeth),
        compression_harmonic=response(array("compression_harmonic") / static, N, len(orders), 2),
        harmonic_response=response(each_sensor("harmonic_response"), s, n, len(orders), 2),
        orders=orders,
        reference_variance=np.array([number(suffixed("reference_variance", sensors, sensor)) for sensor in sensors]),
        contact_loss=row["contact_loss"].as_py(),
    )
