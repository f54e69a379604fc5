"""Rows: a template, turned to its tooth, with a specimen and noise, analysed. No simulation.

Where a turn is exact, a row with damage at tooth t is ``roll(y_D + Y_D roll(e, -(t - 1)), (t - 1) n / teeth)``, e the
specimen's index errors; harmonic excitations, fixed to the shaft, turn by ``-(t - 1) 360 / teeth`` deg in the template.
Else every tooth has its own template and nothing turns.
"""

import time
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from sigdb.core.streams import NOISE_BLOCK, noise_stream, specimen_stream
from sigdb.core.typing import FloatArray, IntArray
from sigdb.database.receipts import Receipt
from sigdb.database.schema import suffixed
from sigdb.database.storage import Store
from sigdb.database.writer import write_part
from sigdb.measurement import index_errors, noise_deviation, revolution_scatter
from sigdb.signature import indicators, mesh_bands, order_spectrum, pooled_wigner_ville
from sigdb.sweep.bank import Template, TemplateBank
from sigdb.sweep.columns import plan_schema
from sigdb.sweep.plan import Plan, RigPoint
from sigdb.sweep.templates import contact_loss_sentence

_BESIDE = (
    "the mesh loses contact, and unbalance, run-out or a fluctuating load act beside the damage: the motion with "
    "damage at one tooth is not that at another turned; reduce the damage, or leave those out"
)


def make_row_part(plan: Plan, store: Store, part: int) -> Receipt:
    """Make the rows of a part from the stored templates and write their features and signals."""
    started = time.perf_counter()
    first, stop = plan.row_range(part)
    tables = row_tables(plan, store, first, stop)
    failed = tables["features"].num_rows - pc.sum(pc.equal(tables["features"]["status"], "ok")).as_py()
    return write_part(store, "rows", part, tables, first=first, failed=failed, started=started)


def row_tables(plan: Plan, store: Store, start: int, stop: int) -> dict[str, pa.Table]:
    """The tables ``features`` and ``signals`` of rows ``start`` to ``stop - 1``; start begins a noise block."""
    schema, bank = plan_schema(plan), TemplateBank(store, plan.sensors)
    blocks = [_block(plan, bank, first, min(first + NOISE_BLOCK, stop)) for first in range(start, stop, NOISE_BLOCK)]
    return {
        table: pa.table(
            [
                pa.chunked_array([_arrow(block, field) for block in blocks], type=field.type)
                for field in schema.arrow(table)
            ],
            schema=schema.arrow(table),
        )
        for table in ("features", "signals")
    }


def _arrow(block: dict[str, Any], field: pa.Field) -> pa.Array:
    """A block's column; null where no row has a value, or a value is nan."""
    missing = [None] * len(block["id"])
    return pa.array(block.get(field.name, missing), field.type, from_pandas=True)


def _block(plan: Plan, bank: TemplateBank, start: int, stop: int) -> dict[str, Any]:
    """Columns of the rows of one noise block."""
    cases = plan.table(start, stop)
    averages = _Averages(len(cases), len(plan.sensors))
    averages.draw_noise(plan, cases, start // NOISE_BLOCK)
    for number in np.unique(cases["template"]):
        rows = np.flatnonzero(cases["template"] == number)
        point = plan.rig_points[plan.case(int(number)).rig_point]
        averages.fill(plan, point, bank[int(number)], cases.iloc[rows], rows)
    return {str(name): cases[name].to_numpy() for name in cases} | averages.columns(plan, cases["teeth"].to_numpy())


class _Averages:
    """The synchronous averages of a block of rows, as they come about.

    Attributes
    ----------
    status, least
        Status of each row, and the least compression of its mesh as a fraction of the static one.
    white, scatter
        Noise of each average, (sensors, n), and its measured scatter, (sensors,), for a unit deviation; then in the
        signal's unit.
    tsa
        Average of each row, (sensors, n) float32; None for a row without result.
    """

    def __init__(self, rows: int, sensors: int) -> None:
        self.status = ["ok"] * rows
        self.least = np.full(rows, np.nan)
        self.contact_loss: list[bool | None] = [None] * rows
        self.white: list[FloatArray] = []
        self.scatter = np.full((rows, sensors), np.nan)
        self.tsa: list[FloatArray | None] = [None] * rows

    def draw_noise(self, plan: Plan, cases: pd.DataFrame, block: int) -> None:
        """Draw every row's noise, whether it will have a result or not: a row depends on nothing but its id."""
        stream, sensors = noise_stream(plan.seed, block), len(plan.sensors)
        for row, (teeth, averages) in enumerate(zip(cases["teeth"], cases["averages"], strict=True)):
            n = teeth * plan.signature.samples_per_tooth
            self.white.append(stream.standard_normal((sensors, n)) / np.sqrt(averages))
            self.scatter[row] = revolution_scatter(stream, np.ones(sensors), n, averages)

    def fill(self, plan: Plan, point: RigPoint, template: Template, cases: pd.DataFrame, rows: IntArray) -> None:
        """The averages of the rows of one template."""
        if template.status != "ok":
            for row in rows:
                self.status[row], self.least[row] = template.status, template.min_compression
                self.contact_loss[row] = template.contact_loss
            return
        turns = cases["tooth"].to_numpy() - template.tooth
        if template.contact_loss and len(template.orders):
            for row in rows[turns != 0]:
                self.status[row], self.least[row], self.contact_loss[row] = _BESIDE, template.min_compression, True
            cases, rows, turns = cases[turns == 0], rows[turns == 0], turns[turns == 0]
            if not len(rows):
                return
        errors = _turned(_index_errors(plan, point, cases), -turns)
        phases = _phases(template.orders, turns * 2 * np.pi / point.teeth)
        compression = template.compression + errors @ template.compression_response.T
        compression += np.einsum("nop,rop->rn", template.compression_harmonic, phases)
        self.least[rows] = np.minimum(compression.min(axis=1), template.least_elsewhere)
        if template.contact_loss:
            self.least[rows] = template.min_compression
        clean = template.signals + np.einsum("snt,rt->rsn", template.specimen_response, errors, optimize=True)
        clean += np.einsum("snop,rop->rsn", template.harmonic_response, phases)
        clean = _turned(clean, turns * plan.signature.samples_per_tooth)
        deviation = noise_deviation(template.reference_variance, cases["snr_db"].to_numpy()[:, None])
        for row, signals, sigma in zip(rows, clean, deviation, strict=True):
            self.contact_loss[row] = template.contact_loss or bool(self.least[row] < 0)
            if self.contact_loss[row] and not template.contact_loss:
                self.status[row] = contact_loss_sentence(self.least[row])
            else:
                self.tsa[row] = (signals + sigma[:, None] * self.white[row]).astype(np.float32)
                self.scatter[row] *= sigma

    def columns(self, plan: Plan, teeth: IntArray) -> dict[str, Any]:
        """Columns of status and signature."""
        done = np.array([tsa is not None for tsa in self.tsa])
        columns: dict[str, Any] = {
            "status": self.status,
            "min_compression": self.least,
            "contact_loss": self.contact_loss,
        }
        for i, sensor in enumerate(plan.sensors):
            names = ("tsa", "scatter")
            values: tuple[Any, ...] = (
                [None if tsa is None else tsa[i] for tsa in self.tsa],
                np.where(done, self.scatter[:, i], np.nan),
            )
            columns |= {suffixed(name, plan.sensors, sensor): value for name, value in zip(names, values, strict=True)}
            for count in np.unique(teeth[done]):
                rows = np.flatnonzero(done & (teeth == count))
                tsa = np.array([columns[suffixed("tsa", plan.sensors, sensor)][row] for row in rows])
                for name, found in _signature(plan, tsa, int(count)).items():
                    column = columns.setdefault(suffixed(name, plan.sensors, sensor), [None] * len(done))
                    for row, value in zip(rows, found, strict=True):
                        column[row] = value
        return columns


def _signature(plan: Plan, tsa: FloatArray, teeth: int) -> dict[str, FloatArray]:
    """Spectrum, indicators and pooled Wigner-Ville features of averages (rows, n) of one tooth count.

    Pooled features have three bins to a band and a lag window of two tooth passes, so that a feature means the same for
    any tooth count.
    """
    step = plan.signature.samples_per_tooth
    n_bins = 6 * step
    cells = pooled_wigner_ville(tsa, teeth=teeth, bands=mesh_bands(teeth), lag_window=2 * step, n_bins=n_bins)
    return {
        "spectrum": np.abs(order_spectrum(tsa)[1]),
        **indicators(tsa, teeth=teeth),
        "wigner_ville": cells.reshape(len(tsa), -1) / (n_bins * step),
    }


def _phases(orders: FloatArray, angles: FloatArray) -> FloatArray:
    """(rows, orders, 2) cosine and sine of each order's phase in a frame turned by an angle."""
    phase = angles[:, None] * orders
    return np.stack([np.cos(phase), np.sin(phase)], axis=-1)


def _index_errors(plan: Plan, point: RigPoint, cases: pd.DataFrame) -> FloatArray:
    """(rows, teeth) index errors of the rows' specimens, m."""
    unit = [_specimen(plan.seed, int(one), point.teeth, point.mate_teeth) for one in cases["specimen"]]
    return np.array(unit) * cases["index_error"].to_numpy()[:, None]


@lru_cache(maxsize=4096)
def _specimen(seed: int, specimen: int, teeth: int, mate_teeth: int) -> FloatArray:
    return index_errors(specimen_stream(seed, specimen), teeth, mate_teeth)


def _turned(rows: FloatArray, shifts: IntArray) -> FloatArray:
    """Each row rolled along its last axis by its own shift."""
    n = rows.shape[-1]
    at = (np.arange(n) - shifts[:, None]) % n
    return np.take_along_axis(rows, at.reshape(len(rows), *[1] * (rows.ndim - 2), n), axis=-1)
