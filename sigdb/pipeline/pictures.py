"""Pictures of a row of a database, of a study of its grid coverage, and of a rig."""

from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.database import Database
from sigdb.pipeline.recipe import recipe_section
from sigdb.report import (
    ReportSettings,
    among_figure,
    among_simulated,
    campbell_figure,
    coverage_figure,
    rig_figure,
    save_figure,
    signature_figure,
)
from sigdb.sweep import Coverage
from sigdb.transmission import Transmission


def draw_signature(
    database: Database, id: int, path: str | Path, *, sensor: str | None = None, others: Sequence[int] = ()
) -> Path:
    """Draw the signature of a row into a file.

    Parameters
    ----------
    database : Database
        A database.
    id : int
        Id of the row.
    path : str or path-like
        Picture file; its suffix is the format.
    sensor : str, optional
        Sensor; the first stored sensor if left out.
    others : sequence of int
        Ids of rows whose pictures are to be compared with this one: axes and colours hold them all.

    Returns
    -------
    pathlib.Path
        The picture file.

    Raises
    ------
    InputError
        If there is no such row, sensor or format, or a row has no result.
    """
    tsa, *compared = (_average(database, row, sensor) for row in (id, *others))
    (case,) = database.cases(f"id = {id}").to_dict("records")
    sensor = sensor or database.sensors[0]
    teeth, tooth = int(case["teeth"]), _count(case["tooth"])
    damaged_teeth = max(_count(case["damaged_teeth"]), int(tooth > 0))
    settings = recipe_section(database, ReportSettings, "report")
    figure = signature_figure(
        tsa,
        teeth=teeth,
        sensor=str(case.get("sensor", sensor)),
        unit=str(case["unit"] or "unit not stated") if "unit" in case else database.unit("tsa", sensor),
        title=f"Row {id}: {_sentence(case)}",
        damaged=tuple((tooth - 1 + i) % teeth + 1 for i in range(damaged_teeth)),
        settings=settings,
        others=compared,
    )
    save_figure(figure, Path(path), settings)
    return Path(path)


def _average(database: Database, id: int, sensor: str | None) -> FloatArray:
    """Return the average of a row, which must have a result."""
    tsa: FloatArray = database.signals([id], sensor=sensor)["tsa"][0]
    if not np.isfinite(tsa).all() or not len(tsa):
        (status,) = database.cases(f"id = {id}")["status"]
        raise InputError(f"row {id} of {database.store} has no signal: {status}")
    return tsa


_SIMULATED = 3000
"""Greatest number of simulated rows of a picture."""


def draw_among(simulated: Database, measured: Database, path: str | Path, *, where: str | None = None) -> Path:
    """Draw where measured healthy rows lie among simulated ones, as they are and with gain and path removed.

    Parameters
    ----------
    simulated, measured : Database
        A database of a sweep, and one of recordings.
    path : str or path-like
        Picture file; its suffix is the format.
    where : str, optional
        Condition on the measured rows; those labelled healthy if left out.

    Returns
    -------
    pathlib.Path
        The picture file.

    Raises
    ------
    InputError
        If a database is of the other kind, or there are no rows of one tooth count and length.
    """
    if simulated.manifest.is_measured or not measured.manifest.is_measured:
        raise InputError("a picture needs a database of a sweep, and one of recordings as the other")
    rows = measured.cases(f"status = 'ok' and ({where or 'tooth = 0'})")
    if rows.empty:
        raise InputError(f"{measured.store}: no measured row meets {where or 'tooth = 0'}; enter labels, or give where")
    teeth = int(rows["teeth"].iloc[0])
    cases = simulated.cases(f"status = 'ok' and teeth = {teeth}")
    if cases.empty:
        raise InputError(f"{simulated.store}: no simulated row is of {teeth} teeth")
    cases = cases.iloc[np.unique(np.linspace(0, len(cases) - 1, _SIMULATED).round().astype(int))]
    simulated_spectra = simulated.signals(cases["id"])["spectrum"]
    recorded = measured.signals(rows.loc[rows["teeth"] == teeth, "id"])["spectrum"]
    if simulated_spectra.shape[1] != recorded.shape[1]:
        raise InputError(f"{measured.store} and {simulated.store} have averages of different samples a tooth")
    damaged = cases["tooth"].to_numpy() > 0
    views = [
        among_simulated(simulated_spectra, recorded, damaged, teeth=teeth, path_removed=removed)
        for removed in (False, True)
    ]
    title = f"{len(recorded)} measured healthy rows among {len(simulated_spectra)} simulated"
    save_figure(among_figure(views[0], views[1], title=title), Path(path))
    return Path(path)


def draw_coverage(coverage: Coverage, path: str | Path, name: str) -> Path:
    """Draw a study of grid coverage into a file: the match of its cases, and their positions in the grid.

    Parameters
    ----------
    coverage : Coverage
        From :func:`sigdb.sweep.coverage`.
    path : str or path-like
        Picture file; its suffix is the format.
    name : str
        Name of the database, for the title.

    Returns
    -------
    pathlib.Path
        The picture file.

    Raises
    ------
    InputError
        If the suffix names no format of pictures.
    """
    figure = coverage_figure(
        coverage.cases,
        grid=coverage.grid,
        title=f"{name}: {len(coverage.cases)} random cases between its own",
    )
    save_figure(figure, Path(path))
    return Path(path)


def _count(value: float | None) -> int:
    """Return a number of a label; 0 where it is unknown."""
    return 0 if value is None or np.isnan(value) else int(value)


def _sentence(case: Mapping[Hashable, Any]) -> str:
    if "recording" in case:
        place = f", tooth {_count(case['tooth'])}" if _count(case["tooth"]) else ""
        return f"{case['recording']}, {case['averages']} averages; {case['health']}, kind {case['kind']}{place}"
    noise = f"{case['averages']} averages at {case['snr_db']:g} dB, specimen {case['specimen']}"
    if case["tooth"] == 0:
        return f"undamaged {case['gear']}; {noise}"
    if case["pattern"]:
        damage = f"pattern {case['pattern']}"
    else:
        damage = f"loss {case['stiffness_loss']:g}, shift {case['phase_shift_deg']:g} deg"
    return f"{case['gear']} tooth {case['tooth']}, {case['damaged_teeth']} damaged, {damage}; {noise}"


def draw_rig(rig: Transmission, folder: str | Path, *, max_hz: float | None = None) -> list[Path]:
    """Write ``rig.png`` and, for a rig that turns, ``campbell.png`` into a folder.

    Parameters
    ----------
    rig : Transmission
        The rig.
    folder : str or path-like
        Folder of the pictures.
    max_hz : float, optional
        Highest frequency of the Campbell diagram, Hz; by default beyond the third harmonic of the fastest mesh.

    Returns
    -------
    list of pathlib.Path
        The picture files.

    Raises
    ------
    InputError
        If a part of the rig can move freely.
    """
    figures = {"rig.png": rig_figure(rig)}
    if rig.operating.speed_rpm:
        figures["campbell.png"] = campbell_figure(rig, max_hz=max_hz)
    for name, figure in figures.items():
        save_figure(figure, Path(folder) / name)
    return [Path(folder) / name for name in figures]
