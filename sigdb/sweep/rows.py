"""Rows: a template, turned to its tooth, with a specimen and noise, analysed. No simulation.

A row with damage at tooth t is ``roll(y_D + Y_D roll(e, -(t - 1)), (t - 1) n / teeth)``, e the specimen's index errors.
"""

import time
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from sigdb.core.streams import NOISE_BLOCK, noise_stream, specimen_stream
from sigdb.core.typing import FloatArray, IntArray
from sigdb.database.receipts import Receipt, part_name
from sigdb.database.schema import suffixed
from sigdb.database.writer import write_part
from sigdb.measurement import index_errors, noise_deviation, revolution_scatter
from sigdb.signature import indicators, mesh_bands, order_spectrum, pooled_wigner_ville
from sigdb.sweep.columns import plan_schema
from sigdb.sweep.plan import PART_TEMPLATES, Plan
from sigdb.sweep.templates import contact_loss_sentence


def make_row_part(plan: Plan, root: Path, part: int) -> Receipt:
    """Make the rows of a part from the stored templates and write their features and signals."""
    started = time.perf_counter()
    first = part * plan.part_rows
    tables = row_tables(plan, root, first, min(first + plan.part_rows, plan.rows))
    failed = tables["features"].num_rows - pc.sum(pc.equal(tables["features"]["status"], "ok")).as_py()
    return write_part(root, "rows", part, tables, first=first, failed=failed, started=started)


def row_tables(plan: Plan, root: Path, start: int, stop: int) -> dict[str, pa.Table]:
    """The tables ``features`` and ``signals`` of rows ``start`` to ``stop - 1``; start begins a noise block."""
    schema = plan_schema(plan)
    blocks = [_block(plan, root, first, min(first + NOISE_BLOCK, stop)) for first in range(start, stop, NOISE_BLOCK)]
    return {
        table: pa.table(
            [
                pa.chunked_array([pa.array(block[field.name], field.type, from_pandas=True) for block in blocks])
                for field in schema.arrow(table)
            ],
            schema=schema.arrow(table),
        )
        for table in ("features", "signals")
    }


def _block(plan: Plan, root: Path, start: int, stop: int) -> dict[str, Any]:
    """Columns of the rows of one noise block: an array or a list of arrays and None each."""
    cases = plan.table(start, stop)
    stream = noise_stream(plan.seed, start // NOISE_BLOCK)
    # Every row draws its noise, whether it has a result or not, so that a row depends on nothing but its id.
    noise = [_noise(stream, plan, case) for case in cases.itertuples()]

    columns: dict[str, Any] = {str(name): cases[name].to_numpy() for name in cases}
    columns["status"] = ["ok"] * len(cases)
    columns["min_compression"] = np.full(len(cases), np.nan)
    for template in np.unique(columns["template"]):
        _simulate_rows(plan, root, int(template), cases[cases["template"] == template], noise, columns)
    columns["contact_loss"] = columns["min_compression"] < 0
    for teeth in np.unique(columns["teeth"]):
        _analyse_rows(plan, int(teeth), np.flatnonzero(columns["teeth"] == teeth), columns)
    return columns


def _noise(stream: np.random.Generator, plan: Plan, case: Any) -> tuple[FloatArray, FloatArray]:
    """White noise of an average, (sensors, n), and the measured scatter, (sensors,), for a unit deviation."""
    n = case.teeth * plan.signature.samples_per_tooth
    white = stream.standard_normal((len(plan.sensors), n)) / np.sqrt(case.averages)
    return white, revolution_scatter(stream, np.ones(len(plan.sensors)), n, case.averages)


def _simulate_rows(
    plan: Plan,
    root: Path,
    number: int,
    cases: pd.DataFrame,
    noise: list[tuple[FloatArray, FloatArray]],
    columns: dict[str, Any],
) -> None:
    """Fill ``tsa``, ``scatter``, ``min_compression`` and ``status`` of the rows of one template."""
    template = _templates(root, number // PART_TEMPLATES)[number % PART_TEMPLATES]
    sensors = plan.sensors
    for sensor in sensors:
        for name in ("tsa", "scatter"):
            columns.setdefault(suffixed(name, sensors, sensor), [None] * len(noise))
    rows = cases.index.to_numpy()
    if template["status"] != "ok":
        for row in rows:
            columns["status"][row] = template["status"]
        columns["min_compression"][rows] = (
            np.nan if template["min_compression"] is None else template["min_compression"]
        )
        return

    turns = np.maximum(cases["tooth"].to_numpy() - 1, 0)
    errors = _turned_errors(plan, number, cases, turns)
    step = plan.signature.samples_per_tooth
    compression = template["compression"] + errors @ template["compression_response"].T
    columns["min_compression"][rows] = compression.min(axis=1) / template["static_compression"]
    for i, sensor in enumerate(sensors):
        response = template[suffixed("specimen_response", sensors, sensor)]
        clean = _turned(template[suffixed("tsa", sensors, sensor)] + errors @ response.T, turns * step)
        variance = np.full(len(rows), template[suffixed("reference_variance", sensors, sensor)])
        deviation = noise_deviation(variance, cases["snr_db"].to_numpy())
        for row, signal, sigma in zip(rows, clean, deviation, strict=True):
            least = columns["min_compression"][row]
            if least < 0:
                columns["status"][row] = contact_loss_sentence(least)
                continue
            white, scatter = noise[row]
            columns[suffixed("tsa", sensors, sensor)][row] = (signal + sigma * white[i]).astype(np.float32)
            columns[suffixed("scatter", sensors, sensor)][row] = sigma * scatter[i]


def _turned_errors(plan: Plan, number: int, cases: pd.DataFrame, turns: IntArray) -> FloatArray:
    """(rows, teeth) index errors as seen from the damaged tooth, m."""
    point = plan.rig_points[plan.templates[number].rig_point]
    unit = np.array([_specimen(plan.seed, int(one), point.teeth, point.mate_teeth) for one in cases["specimen"]])
    return _turned(unit, -turns) * cases["index_error"].to_numpy()[:, None]


@lru_cache(maxsize=4096)
def _specimen(seed: int, specimen: int, teeth: int, mate_teeth: int) -> FloatArray:
    return index_errors(specimen_stream(seed, specimen), teeth, mate_teeth)


def _turned(rows: FloatArray, shifts: IntArray) -> FloatArray:
    """Each row rolled by its own shift."""
    n = rows.shape[1]
    return np.take_along_axis(rows, (np.arange(n) - shifts[:, None]) % n, axis=1)


def _analyse_rows(plan: Plan, teeth: int, rows: IntArray, columns: dict[str, Any]) -> None:
    """Fill the signature of the rows of one tooth count that have a result."""
    step = plan.signature.samples_per_tooth
    for sensor in plan.sensors:
        signals = columns[suffixed("tsa", plan.sensors, sensor)]
        done = [row for row in rows if signals[row] is not None]
        if not done:
            continue
        tsa = np.array([signals[row] for row in done])
        found: dict[str, FloatArray] = {"spectrum": np.abs(order_spectrum(tsa)[1])}
        found |= indicators(tsa, teeth=teeth)
        found["wigner_ville"] = _pooled(tsa, teeth, step).reshape(len(done), -1)
        for name, values in found.items():
            column = columns.setdefault(suffixed(name, plan.sensors, sensor), [None] * len(signals))
            for row, value in zip(done, values, strict=True):
                column[row] = value


def _pooled(tsa: FloatArray, teeth: int, step: int) -> FloatArray:
    """Pooled Wigner-Ville features as stored: three bins to a band, a lag window of two tooth passes."""
    n_bins = 6 * step
    cells = pooled_wigner_ville(tsa, teeth=teeth, bands=mesh_bands(teeth), lag_window=2 * step, n_bins=n_bins)
    return cells / (n_bins * step)


@lru_cache(maxsize=4)
def _templates(root: Path, part: int) -> list[dict[str, Any]]:
    """Stored templates of a part, arrays as float64 in their own shapes."""
    path = root / "templates" / part_name(part)
    table = pq.ParquetFile(path, page_checksum_verification=True).read()
    rows: list[dict[str, Any]] = [{} for _ in range(table.num_rows)]
    for name in table.schema.names:
        values = table[name]
        for row, value in zip(rows, values, strict=True):
            is_list = pa.types.is_list(values.type) and value.is_valid
            row[name] = value.values.to_numpy().astype(float) if is_list else value.as_py()
    for row in rows:
        for name, value in row.items():
            if name.split("__")[0] in ("specimen_response", "compression_response") and value is not None:
                row[name] = value.reshape(-1, row["teeth"])
    return rows
