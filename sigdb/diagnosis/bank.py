"""Template banks for a recording: at its operating point, behind its transfer path, and with calibrated models."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError
from sigdb.database import open as open_database
from sigdb.diagnosis.transfer_path import TransferPath
from sigdb.measurement import MeasurementSettings, tooth_cycle
from sigdb.recognition import QUANTITIES, Hypotheses, PointTemplates, TemplateBank, TemplateLocation, TemplateSeverity
from sigdb.signature import SignatureSettings
from sigdb.sweep import Grid, SweepSettings, make_plan, run
from sigdb.transmission import Transmission

LOSSES = (0.0, 0.1, 0.2, 0.4, 0.6, 0.8)
SHIFTS_DEG = (0.0, 1.5, 3.0)
DAMAGED_TEETH = (1, 2)
"""Severities of the templates for a recording: those of the reference database, and greater losses."""

_DRAWS = 2000
"""Averages that are drawn for the calibration."""

_PARTS = 4
"""Parts of a mesh harmonic; the error of an interpolated gain is constant within a part."""


def rig_bank(
    rig: Transmission,
    *,
    gear: str,
    sensor: str,
    speed_rpm: float,
    torque: float,
    samples_per_tooth: int,
    index_error: float,
) -> TemplateBank:
    """Simulate the templates of a rig at one operating point.

    Parameters
    ----------
    rig
        A rig with one mesh.
    gear, sensor
        Damaged gear and sensor, by name.
    speed_rpm, torque
        Operating point, rpm and N m, as in the rig's ``operating``.
    samples_per_tooth
        Samples of an average, for each tooth.
    index_error
        Size of the index errors of both gears, m.

    Raises
    ------
    InputError
        If the rig has several meshes, or loses contact at that operating point.
    """
    at = rig.replace({"operating.speed_rpm": speed_rpm, "operating.torque": torque})
    grid = Grid(tooth=(1,), damaged_teeth=DAMAGED_TEETH, phase_shift_deg=SHIFTS_DEG, stiffness_loss=LOSSES)
    design = SweepSettings(rig=rig.name, gear=gear, healthy=1, grid=(grid,))
    # A bank needs one row of each template. The gears are nominal, so that none of them loses contact.
    cycle = tooth_cycle(rig.gears[gear].teeth, rig.gears[rig.mate(gear)].teeth)
    measured = MeasurementSettings(averages=2 * cycle, index_error=0.0)
    plan = make_plan(design, measured, SignatureSettings(samples_per_tooth=samples_per_tooth, sensors=(sensor,)), at)
    with TemporaryDirectory() as folder:
        run(plan, Path(folder), jobs=1)
        database = open_database(folder)
        if database.sql("select 1 from templates where tooth = 0 and status = 'ok' and not contact_loss").empty:
            raise InputError(
                f"rig {rig.name} has no templates at {speed_rpm:.5g} rpm and {torque:.5g} N m, where the teeth of its "
                f"healthy gears part; its operating point is {rig.operating.speed_rpm:.5g} rpm and "
                f"{rig.operating.torque:.5g} N m: check the sampling rate, the tacho and the torque"
            )
        return TemplateBank.of(database, index_error=index_error)


def at_operating_point(bank: TemplateBank, *, speed_rpm: float, torque: float, teeth: int) -> TemplateBank:
    """Return the templates of the nearest operating point with this tooth count."""
    (nearest,) = bank.nearest(np.array([speed_rpm]), np.array([torque]), np.array([teeth]))
    return replace(bank, points=(bank.points[nearest],))


def behind_path(bank: TemplateBank, path: TransferPath) -> TemplateBank:
    """Return a bank whose averages are seen through a transfer path.

    Between mesh harmonics the gain is interpolated. Its relative error there is assumed to be normal with the path's
    standard deviation, independent in real and imaginary part and in each quarter of a mesh harmonic. It acts on the
    difference of a template from the healthy template, which is exact by construction. So it joins the modes of the
    index errors, and the bank's ``index_error`` is 1, since both are in the unit of the signal.
    """
    points = tuple(_point_behind_path(point, path, bank.index_error) for point in bank.points)
    return replace(bank, points=points, index_error=1.0)


def _point_behind_path(point: PointTemplates, path: TransferPath, index_error: float) -> PointTemplates:
    laws = point.hypotheses
    if laws.signal.shape[1] != path.samples:
        raise InputError(
            f"averages of the bank have {laws.signal.shape[1]} samples, those of the recording {path.samples}; "
            "average with as many samples a tooth"
        )
    signal = path(laws.signal)
    response = path(laws.modes * laws.gains[:, None, :] * index_error, axis=1)
    uncertain = _uncertain(signal - signal[laws.healthy][0], path, point.teeth)
    modes, gains, _ = np.linalg.svd(np.concatenate([response, uncertain], axis=2), full_matrices=False)
    law = Hypotheses(
        teeth=point.teeth,
        cases=laws.cases.assign(**dict(zip(QUANTITIES, point.severity.T, strict=True))),
        signal=signal,
        modes=modes,
        gains=gains,
        harmonic=path(laws.harmonic, axis=1),
        phases=laws.phases,
        reference_variance=np.full(len(signal), signal[laws.healthy][0].var()),
    )
    at = (point.speed_rpm, point.torque)
    (templates,) = PointTemplates.of([law], [point.share], points=[at], index_error=1.0)
    return templates


def _uncertain(change: FloatArray, path: TransferPath, teeth: int) -> FloatArray:
    """Return (templates, n, modes) effects on each template of a gain error in each part of the path's band."""
    n, orders = path.samples, np.arange(len(path.gain))
    part = np.where(path.covered & (orders % teeth > 0), orders * _PARTS // teeth, -1)
    spectrum = np.fft.rfft(change)
    parts = np.unique(part[part >= 0])[: None if path.error else 0]
    modes = np.zeros((len(change), n, 2 * len(parts)))
    for i, number in enumerate(parts):
        effect = np.where(part == number, path.error * spectrum, 0)
        modes[:, :, 2 * i] = np.fft.irfft(effect, n)
        modes[:, :, 2 * i + 1] = np.fft.irfft(1j * effect, n)
    return modes


def draw_averages(
    bank: TemplateBank, path: TransferPath, *, noise: float, averages: int, seed: int = 0
) -> pd.DataFrame:
    """Draw averages from the law of a bank with one operating point, half of them healthy, all of new specimens.

    Parameters
    ----------
    bank
        Templates of one operating point.
    path
        Transfer path; the noise is limited to its band too.
    noise
        Standard deviation of an average's noise.
    averages
        Revolutions of an average, for the table.
    seed
        Seed of the draws.

    Returns
    -------
    pandas.DataFrame
        The columns that template estimators read, ``tooth`` and the severities.
    """
    (point,), stream = bank.points, np.random.default_rng(seed)
    damaged = stream.random(_DRAWS) < 0.5
    template = np.array([stream.choice(len(point.share), p=_share(point, is_damaged)) for is_damaged in damaged])
    tooth = np.where(damaged, stream.integers(1, point.teeth + 1, _DRAWS), 0)
    x = point.hypotheses.draw(stream, template, np.maximum(tooth, 1), noise=noise, index_error=bank.index_error)
    rows = average_rows(point, path.band(x), noise=noise, averages=averages)
    severity = np.where(damaged[:, None], point.severity[template], 0.0)
    return rows.assign(tooth=tooth, **dict(zip(QUANTITIES, severity.T, strict=True)))


def average_rows(point: PointTemplates, x: FloatArray, *, noise: float, averages: int) -> pd.DataFrame:
    """Return averages (rows, n) as the rows that template estimators read."""
    return pd.DataFrame(
        {
            "teeth": point.teeth,
            "speed_rpm": point.speed_rpm,
            "torque": point.torque,
            "averages": averages,
            "scatter": noise * np.sqrt(averages),
            "tsa": list(x),
        }
    )


def calibrate_models(bank: TemplateBank, drawn: pd.DataFrame) -> tuple[TemplateLocation, TemplateSeverity]:
    """Return location and severity models of a bank, calibrated on draws from its law."""
    groups = np.arange(len(drawn))
    location = TemplateLocation(bank).fit(drawn, drawn["tooth"], groups)
    return location, TemplateSeverity(bank).fit(drawn, drawn[["tooth", *QUANTITIES]], groups)


def _share(point: PointTemplates, damaged: bool) -> FloatArray:
    """Return the probabilities of the damaged or of the healthy templates; the others are 0."""
    share = np.where(point.healthy != damaged, point.share, 0.0)
    return share / share.sum()
