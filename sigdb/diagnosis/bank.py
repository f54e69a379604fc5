"""The templates that a recording is compared with: at its own operating point, as its own sensor would give them."""

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
"""Severities of the templates that are made for a recording: those of the reference database, and greater losses."""

_DRAWS = 2000

_PARTS = 4
"""Parts of a mesh harmonic, within each of which the error of an interpolated gain is one."""


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
    """Templates of a rig at one operating point, simulated now.

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
        If the rig has several meshes, or loses contact there.
    """
    at = rig.replace({"operating.speed_rpm": speed_rpm, "operating.torque": torque})
    grid = Grid(tooth=(1,), damaged_teeth=DAMAGED_TEETH, phase_shift_deg=SHIFTS_DEG, stiffness_loss=LOSSES)
    design = SweepSettings(rig=rig.name, gear=gear, healthy=1, grid=(grid,))
    # A row of each template is all that a bank needs, of nominal gears, so that none of them loses contact.
    cycle = tooth_cycle(rig.gears[gear].teeth, rig.gears[rig.mate(gear)].teeth)
    measured = MeasurementSettings(averages=2 * cycle, index_error=0.0)
    plan = make_plan(design, measured, SignatureSettings(samples_per_tooth=samples_per_tooth, sensors=(sensor,)), at)
    with TemporaryDirectory() as folder:
        run(plan, Path(folder), jobs=1)
        return TemplateBank.of(open_database(folder), index_error=index_error)


def at_point(bank: TemplateBank, *, speed_rpm: float, torque: float, teeth: int) -> TemplateBank:
    """The templates of the operating point that is nearest, of this tooth count."""
    (place,) = bank.nearest(np.array([speed_rpm]), np.array([torque]), np.array([teeth]))
    return replace(bank, points=(bank.points[place],))


def through(bank: TemplateBank, path: TransferPath) -> TemplateBank:
    """A bank as a sensor behind a path would give its averages.

    Between mesh harmonics the gain is interpolated. Its relative error there is taken as normal, independent in real
    and imaginary part and in each quarter of a mesh harmonic, of the path's standard deviation. It acts on what a
    template differs by from the healthy one, which is right by construction. So it joins the modes of the index errors,
    and the bank's ``index_error`` is 1, both being in the unit of the signal.
    """
    points = tuple(_through(point, path, bank.index_error) for point in bank.points)
    return replace(bank, points=points, index_error=1.0)


def _through(point: PointTemplates, path: TransferPath, index_error: float) -> PointTemplates:
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
    (found,) = PointTemplates.of([law], [point.share], points=[at], index_error=1.0)
    return found


def _uncertain(change: FloatArray, path: TransferPath, teeth: int) -> FloatArray:
    """(templates, n, modes) what an error of the gain in each part of the path's band does to each template."""
    n, orders = path.samples, np.arange(len(path.gain))
    part = np.where(path.known & (orders % teeth > 0), orders * _PARTS // teeth, -1)
    spectrum = np.fft.rfft(change)
    parts = np.unique(part[part >= 0])[: None if path.error else 0]
    modes = np.zeros((len(change), n, 2 * len(parts)))
    for i, one in enumerate(parts):
        some = np.where(part == one, path.error * spectrum, 0)
        modes[:, :, 2 * i] = np.fft.irfft(some, n)
        modes[:, :, 2 * i + 1] = np.fft.irfft(1j * some, n)
    return modes


def draws(bank: TemplateBank, path: TransferPath, *, noise: float, averages: int, seed: int = 0) -> pd.DataFrame:
    """Averages drawn from the law of a bank of one point, half of them healthy, each of a specimen of its own.

    Parameters
    ----------
    bank
        One operating point.
    path
        What is not in its band is taken from the noise too.
    noise
        Standard deviation of an average's noise.
    averages
        Revolutions in it, for the frame.
    seed
        Of the draws.

    Returns
    -------
    pandas.DataFrame
        What estimators of templates read, and ``tooth`` and the severities.
    """
    (point,), stream = bank.points, np.random.default_rng(seed)
    damaged = stream.random(_DRAWS) < 0.5
    template = np.array([stream.choice(len(point.share), p=_share(point, one)) for one in damaged])
    tooth = np.where(damaged, stream.integers(1, point.teeth + 1, _DRAWS), 0)
    x = point.hypotheses.draw(stream, template, np.maximum(tooth, 1), noise=noise, index_error=bank.index_error)
    frame = averages_frame(point, path.band(x), noise=noise, averages=averages)
    severity = np.where(damaged[:, None], point.severity[template], 0.0)
    return frame.assign(tooth=tooth, **dict(zip(QUANTITIES, severity.T, strict=True)))


def averages_frame(point: PointTemplates, x: FloatArray, *, noise: float, averages: int) -> pd.DataFrame:
    """Averages (rows, n) as the rows that estimators of templates read."""
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


def calibrate(bank: TemplateBank, drawn: pd.DataFrame) -> tuple[TemplateLocation, TemplateSeverity]:
    """Location and severity by a bank, calibrated on draws of its law: at the recording's own level of noise."""
    groups = np.arange(len(drawn))
    location = TemplateLocation(bank).fit(drawn, drawn["tooth"], groups)
    return location, TemplateSeverity(bank).fit(drawn, drawn[["tooth", *QUANTITIES]], groups)


def _share(point: PointTemplates, damaged: bool) -> FloatArray:
    """Shares of the templates of a kind; those that weigh nothing are not drawn."""
    share = np.where(point.healthy != damaged, point.share, 0.0)
    return share / share.sum()
