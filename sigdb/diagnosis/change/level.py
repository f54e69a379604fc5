"""Level and sensor: what of a change is the same for all teeth, and its likelier cause."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.change import highest_common, orders_of_bands
from sigdb.diagnosis.change.healthy_set import HealthySet

LEAST_DB = 1.0
"""Change of a level, dB, below which it is not reported; assumed: sensors are mounted again no better."""

_SAME_DB = 1.5
"""Greatest spread of the changes of all levels, dB, that is one gain of the sensor."""

_OPPOSITE = np.pi / 4
"""Distance of the phases of all gains from half a turn up to which the polarity is reversed."""

_RARE = 1e-3
"""Probability below which levels differ from those of the healthy recordings."""

_CAUTION = 1.2
"""Factor of the limit; assumed."""

OTHER_SPEED, OTHER_LOAD = 0.02, 0.05
"""Relative differences of speeds and of loads that change levels."""

_ABOVE_NOISE = 10.0
"""Amplitude of a mesh harmonic, in deviations of its noise, from which on its level counts."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LevelChange:
    """Change of the levels since the healthy recordings.

    Attributes
    ----------
    harmonics : ndarray
        Mesh harmonics.
    mesh_db, sidebands_db, band_db : ndarray
        Change of each mesh harmonic, of the orders within two of it, and of its whole band, dB.
    distance, limit : float
        Mahalanobis distance of these changes from the healthy recordings. Noise exceeds the limit with a probability of
        0.001, and no group of revolutions of the healthy recordings does, with a margin of a fifth.
    cause : str
        Likelier cause of a change: ``none``, ``speed``, ``load``, ``sensor gain``, ``polarity`` or ``load or
        mounting``.
    """

    harmonics: IntArray
    mesh_db: FloatArray
    sidebands_db: FloatArray
    band_db: FloatArray
    distance: float
    limit: float
    cause: str

    @property
    def changed(self) -> bool:
        """Whether the levels have changed, or the polarity."""
        return self.cause != "none"


def level_change(
    run: AverageSpectrum,
    reference: AverageSpectrum,
    healthy: HealthySet,
    *,
    speeds_rpm: tuple[float | None, float | None],
    torques: tuple[float | None, float | None],
) -> LevelChange:
    """Return the change of the levels of a run since its healthy reference, with the likelier cause.

    The levels are, for each mesh harmonic, the logarithms of its amplitude, of the rms of the two orders to both sides,
    and of the rms of its band. Their distance is that of Mahalanobis [1]_, with a shrunk covariance [2]_ of the groups
    of revolutions of the healthy recordings and, of several recordings, of the differences between them. A run of more
    groups than each healthy recording has counts with as many of them, spread over all.

    Parameters
    ----------
    run, reference
        Spectra of the run and its reference.
    healthy
        Healthy recordings.
    speeds_rpm, torques
        Speeds and torques of the run and of the reference.

    References
    ----------
    .. [1] Mahalanobis, "On the generalised distance in statistics", Proceedings of the National Institute of Sciences
       of India 2(1), 1936.
    .. [2] Ledoit, Wolf, "A well-conditioned estimator for large-dimensional covariance matrices", Journal of
       Multivariate Analysis 88(2), 2004, doi:10.1016/S0047-259X(03)00096-4.
    """
    most = max(len(each.spectrum.groups) for each in healthy.recordings)
    if len(run.groups) > most:  # of joined recordings: levels have less noise the more revolutions there are
        run = run.part(np.linspace(0, len(run.groups) - 1, most).round().astype(int))
    highest = highest_common(run, reference, *(each.spectrum for each in healthy.recordings))
    bands = [
        (h, k)
        for h, k in orders_of_bands(run.teeth, run.samples, highest)
        if any(_stands_out(spectrum, h * run.teeth) for spectrum in (run, reference))
    ]
    harmonics = np.array([h for h, _ in bands], int)
    decibels = _levels(run, bands, len(run.groups)) - _levels(reference, bands, len(reference.groups))
    if not len(bands):
        empty = np.zeros(0)
        return LevelChange(
            harmonics=harmonics,
            mesh_db=empty,
            sidebands_db=empty,
            band_db=empty,
            distance=0.0,
            limit=np.inf,
            cause="none",
        )
    rows = np.concatenate([_centred(each.spectrum, bands) for each in healthy.recordings])
    scale = np.maximum(rows.std(axis=0), np.finfo(float).tiny)
    of_groups = shrunk_covariance(rows / scale)
    covariance = of_groups * (1 / len(run.groups) + 1 / len(reference.groups))
    covariance += np.diag(sum(_noise_variance(each, bands) for each in (run, reference)) / scale**2)
    if len(healthy) > 1:
        means = np.array([_levels(each.spectrum, bands, len(each.spectrum.groups)) for each in healthy.recordings])
        covariance = covariance + shrunk_covariance((means - means.mean(axis=0)) / scale)
    distance = float(np.sqrt(decibels / scale @ np.linalg.solve(covariance, decibels / scale)))
    greatest = left_out_distances(rows / scale).max()
    limit = _CAUTION * float(np.sqrt(max(chdtri(len(decibels), _RARE), greatest)))
    mesh, side, whole = decibels.reshape(3, -1)
    return LevelChange(
        harmonics=harmonics,
        mesh_db=mesh,
        sidebands_db=side,
        band_db=whole,
        distance=distance,
        limit=limit,
        cause=next(
            _causes(decibels, _mesh_phases(run, reference, harmonics), distance > limit, speeds_rpm, torques), "none"
        ),
    )


def common_change_db(run: AverageSpectrum, reference: AverageSpectrum) -> float:
    """Return the change of level that all mesh harmonics have in common, dB: what load, speed and gain change.

    It is the least of their changes where all have the same sign, and 0 elsewhere. Harmonics count that stand out of
    the noise of both, as the reference has them.
    """
    harmonics = [h for h, _ in orders_of_bands(run.teeth, run.samples, highest_common(run, reference))]
    order = np.array([h * run.teeth for h in harmonics], int)
    noise = np.sqrt(np.maximum(run.variance[order], reference.variance[order]))
    order = order[np.abs(reference.mean[order]) > _ABOVE_NOISE * noise]
    ratio = np.abs(run.mean[order]) / np.abs(reference.mean[order])
    changes = 20 * np.log10(np.maximum(ratio, np.finfo(float).tiny))
    same = len(changes) and abs(np.sign(changes).sum()) == len(changes)
    return float(np.sign(changes[0]) * np.abs(changes).min()) if same else 0.0


def shrunk_covariance(rows: FloatArray) -> FloatArray:
    """Return the covariance (p, p) of centred rows (n, p), shrunk to a multiple of the identity by Ledoit and Wolf.

    It is that of scikit-learn, whose import would take longer than the diagnosis.
    """
    n, p = rows.shape
    sample = rows.T @ rows / n
    mean = np.trace(sample) / p
    share = _shrinkage(n, p, mean, np.sum(sample**2), np.sum(np.sum(rows**2, axis=1) ** 2))
    return np.asarray((1 - share) * sample + share * mean * np.eye(p))


def _shrinkage(
    n: int, p: int, mean: FloatArray | float, square: FloatArray | float, fourth: FloatArray | float
) -> FloatArray:
    """Return the share of the identity in the covariance by Ledoit and Wolf.

    Parameters
    ----------
    n, p
        Numbers of rows and of columns.
    mean, square
        Mean of the diagonal of the sample covariance, and the sum of its squares.
    fourth
        Sum over the rows of the fourth power of their length.
    """
    distance = square / p - np.square(mean)
    error = (fourth / n - square) / (n * p)
    return np.where(distance > 0, np.minimum(error / np.where(distance > 0, distance, 1), 1), 1)


def _noise_variance(spectrum: AverageSpectrum, bands: list[tuple[int, IntArray]]) -> FloatArray:
    """Return the variance (3 H,) of the levels of the mean spectrum by its noise, dB^2.

    With the noise v at an order, the power P of the average there has the variance ``2 (P - v) v + v^2``.
    """
    results = []
    for k in _sets(bands, spectrum.teeth):
        P, v = np.abs(spectrum.mean[k]) ** 2, spectrum.variance[k]
        variance = np.sum(2 * np.maximum(P - v, 0) * v + v**2) / len(k) ** 2
        results.append(variance / np.mean(P + v) ** 2)
    return (10 / np.log(10)) ** 2 * np.array(results)


def left_out_distances(rows: FloatArray) -> FloatArray:
    """Return the squared distance (n,) of each row (n, p) from the others, with their shrunk covariance.

    With the deviation z of a row from the mean of all n, the others have the scatter ``T - z z' n / (n - 1)``. So one
    decomposition of the scatter T of all rows gives the distances of all, by the formula of Sherman and Morrison.
    """
    n, p = rows.shape
    others, z = n - 1, rows - rows.mean(axis=0)
    values, vectors = np.linalg.eigh(z.T @ z)
    turned = (z @ vectors) ** 2
    lengths, taken = turned.sum(axis=1), n / others**2
    mean = (values.sum() / others - taken * lengths) / p
    square = np.sum(values**2) / others**2 - 2 * taken / others * (turned @ values) + (taken * lengths) ** 2
    apart = (lengths + 2 / others * (z @ z.T) + lengths[:, None] / others**2) ** 2
    share = _shrinkage(others, p, mean, square, apart.sum(axis=1) - np.diagonal(apart))[:, None]
    u = np.sum(turned / ((1 - share) * values / others + share * mean[:, None]), axis=1)
    return np.asarray(n / others * u / (1 - (1 - share[:, 0]) * taken * u))


def _levels(spectrum: AverageSpectrum, bands: list[tuple[int, IntArray]], count: int) -> FloatArray:
    """Return the levels (3 H,) of the mean spectrum, dB, with at least the level of its noise."""
    return _decibels(spectrum.mean[None], spectrum.spread / count, bands, spectrum.teeth)[0]


def _centred(spectrum: AverageSpectrum, bands: list[tuple[int, IntArray]]) -> FloatArray:
    """Return the levels (G, 3 H) of each group less their mean."""
    levels = _decibels(spectrum.groups, spectrum.spread, bands, spectrum.teeth)
    return np.asarray(levels - levels.mean(axis=0))


def _decibels(X: ComplexArray, variance: FloatArray, bands: list[tuple[int, IntArray]], teeth: int) -> FloatArray:
    power = np.abs(X) ** 2
    levels = np.stack([power[:, k].mean(axis=1) + variance[k].mean() for k in _sets(bands, teeth)], axis=1)
    return np.asarray(10 * np.log10(np.maximum(levels, np.finfo(float).tiny)))


def _sets(bands: list[tuple[int, IntArray]], teeth: int) -> list[IntArray]:
    """Return the orders of each level: mesh harmonics, sidebands, bands."""
    meshes = [np.array([h * teeth]) for h, _ in bands]
    return [*meshes, *(h * teeth + np.array([-2, -1, 1, 2]) for h, _ in bands), *(k for _, k in bands)]


def _stands_out(spectrum: AverageSpectrum, order: int) -> bool:
    return bool(np.abs(spectrum.mean[order]) > _ABOVE_NOISE * np.sqrt(spectrum.variance[order]))


def _mesh_phases(run: AverageSpectrum, reference: AverageSpectrum, harmonics: IntArray) -> FloatArray:
    """Return the phase of each mesh harmonic of the run relative to the reference."""
    order = harmonics * run.teeth
    return np.angle(run.mean[order] * np.conj(reference.mean[order]))


def _causes(
    decibels: FloatArray,
    phases: FloatArray,
    rare: bool,
    speeds: tuple[float | None, float | None],
    torques: tuple[float | None, float | None],
) -> Iterator[str]:
    """Yield the causes of a change of levels, the likeliest first."""
    mesh, _, whole = decibels.reshape(3, -1)
    if phases.size and np.all(np.abs(np.abs(phases) - np.pi) < _OPPOSITE):
        yield "polarity"
    levels = np.concatenate([mesh, whole])
    if not rare or np.abs(levels).max() < LEAST_DB:
        return
    for name, (run, reference), least in (("speed", speeds, OTHER_SPEED), ("load", torques, OTHER_LOAD)):
        if run is not None and reference is not None and abs(run - reference) > least * abs(reference):
            yield name
    if np.ptp(mesh) < _SAME_DB:
        yield "sensor gain"
    yield "load or mounting"
