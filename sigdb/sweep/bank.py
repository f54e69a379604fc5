"""The stored templates of a database that is being made, read part by part."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from sigdb.core.typing import FloatArray
from sigdb.database.checked import open_checked
from sigdb.database.receipts import read_receipt
from sigdb.database.schema import suffixed
from sigdb.database.storage import Store
from sigdb.sweep.plan import PART_TEMPLATES

_PARTS_KEPT = 4


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


class TemplateBank:
    """Templates by number."""

    def __init__(self, store: Store, sensors: Sequence[str]) -> None:
        self._store, self._sensors = store, sensors
        self._parts: dict[int, list[Template]] = {}

    def __getitem__(self, number: int) -> Template:
        part, within = divmod(number, PART_TEMPLATES)
        if part not in self._parts:
            if len(self._parts) == _PARTS_KEPT:
                self._parts.pop(next(iter(self._parts)))
            self._parts[part] = self._read(part)
        return self._parts[part][within]

    def _read(self, part: int) -> list[Template]:
        file = read_receipt(self._store, "templates", part).file("templates")
        table = pq.ParquetFile(open_checked(self._store, file)).read()
        return [self._template(row) for row in table.to_pandas().to_dict("records")]

    def _template(self, row: dict[Any, Any]) -> Template:
        if row["status"] != "ok":
            none = np.empty(0)
            return Template(
                status=row["status"],
                tooth=row["tooth"],
                min_compression=row["min_compression"],
                least_elsewhere=np.inf,
                compression=none,
                compression_response=none,
                signals=none,
                specimen_response=none,
                compression_harmonic=none,
                harmonic_response=none,
                orders=none,
                reference_variance=none,
                contact_loss=row["contact_loss"],
            )

        def stored(name: str) -> list[Any]:
            return [row[suffixed(name, self._sensors, sensor)] for sensor in self._sensors]

        def each_sensor(name: str) -> FloatArray:
            return np.array(stored(name), dtype=float)

        signals, static, teeth = each_sensor("tsa"), row["static_compression"], row["teeth"]
        compression = row["compression"].astype(float) / static
        orders = np.asarray(row["orders"], float)
        loses = bool(row["contact_loss"])
        n = signals.shape[1]

        def response(stored: Any, *shape: int) -> FloatArray:
            return np.zeros(shape) if loses else np.array(stored, dtype=float).reshape(shape)

        return Template(
            status="ok",
            tooth=row["tooth"],
            min_compression=row["min_compression"],
            least_elsewhere=row["least_elsewhere"],
            compression=compression,
            compression_response=response(row["compression_response"], len(compression), teeth) / static,
            signals=signals,
            specimen_response=response(stored("specimen_response"), len(signals), n, teeth),
            compression_harmonic=response(row["compression_harmonic"], len(compression), len(orders), 2) / static,
            harmonic_response=response(stored("harmonic_response"), len(signals), n, len(orders), 2),
            orders=orders,
            reference_variance=each_sensor("reference_variance"),
            contact_loss=loses,
        )
