"""Statistics of a change that one damaged tooth raises: short pulses of any shape, and the templates of rigs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from math import lgamma, log

import numpy as np
from scipy.fft import ifft
from scipy.optimize import brentq
from scipy.special import gammaincc, logsumexp

from sigdb.core import ComplexArray, FloatArray, IntArray
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.change import PLACES, Change, envelopes, excess, highest_common, orders_of_bands
from sigdb.diagnosis.change.templates import BehindPath

WIDTHS = (0.4, 0.8, 1.6)
"""Widths of the pulses, in tooth passes over pi."""

NOISE_ALARMS = 1e-3
"""Probability that noise alone exceeds its limit somewhere in the turn."""

INDEPENDENT = 2.0
"""Places in a tooth pass at which a statistic of noise is independent: a band is one tooth order wide, and the two
sides of a harmonic are independent."""

_WIDTHS_THAT_DIFFER = 2
"""Number of independent pulses of the three widths."""

_SIZES = np.geomspace(0.1, 1000.0, 9)
"""Energies of a pulse in a band that shows it, over that of noise, for its evidence: equally likely; assumed."""

_SHOWN = 0.5
"""Share of the bands that show a pulse, for its evidence; assumed."""

_EXPECTED = 50.0
"""Energy of a template over noise, of all bands, for which the bands are weighted: that of damage that is just seen."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Statistic:
    """A statistic over the turn, relative to the limit that noise alone exceeds with a probability of 0.001.

    Attributes
    ----------
    value
        (8 Z,) statistic at each place.
    best
        (8 Z,) number of the pulse or template with the greatest value at each place.
    ratio
        (8 Z,) logarithm of the likelihood ratio of that pulse or template to none, over the misfit.
    """

    value: FloatArray
    best: IntArray
    ratio: FloatArray

    @property
    def greatest(self) -> float:
        """Greatest value over the turn."""
        return float(self.value.max(initial=0.0))

    @property
    def place(self) -> float:
        """Place of the greatest value, in tooth passes after the beginning of the average."""
        return float(np.argmax(self.value)) / PLACES


@cache
def noise_limit(shape: float, tries: float) -> float:
    """Return the value that the greatest of independent noise energies exceeds with a probability of 0.001.

    The squared magnitude of one complex amplitude of noise, relative to its mean, follows the exponential law; the sum
    over B bands the gamma law with shape B. The probability for the greatest of N is at most N times that for one.

    Parameters
    ----------
    shape
        Shape of the gamma law: the bands B.
    tries
        Number N.

    Examples
    --------
    >>> round(noise_limit(1, 1), 3), round(float(-np.log(1e-3)), 3)
    (6.908, 6.908)
    """
    wanted = log(NOISE_ALARMS / tries)
    return float(brentq(lambda x: _log_tail(shape, x) - wanted, 1e-9, 1e4 + 10 * shape))


@cache
def _limit_curve(most: int, tries: float) -> tuple[FloatArray, FloatArray]:
    """Return shapes of the gamma law up to the number of bands, and the limit of noise for each."""
    shapes = np.arange(2, 4 * most + 1) / 4
    return shapes, np.array([noise_limit(float(shape), tries) for shape in shapes])


def _log_tail(shape: float, x: float) -> float:
    tail = float(gammaincc(shape, x))
    return log(tail) if tail > 1e-290 else (shape - 1) * log(x) - x - lgamma(shape)


def nothing(change: Change) -> Statistic:
    """Return the statistic of a change without a band in which anything could be seen."""
    zero = np.zeros(PLACES * change.teeth)
    return Statistic(value=zero, best=np.zeros(zero.size, int), ratio=zero)


def pulse_statistic(change: Change) -> Statistic:
    """Return the energy of short pulses at each place of the turn, relative to what the other teeth show.

    A pulse of width c has the amplitudes ``d_k = exp(-(pi c (k - h Z) / Z)^2 / 2) / s_k`` in the band of harmonic h,
    with the deviation s_k. Its complex amplitude is free in each band, so the path and the shape of the pulse need not
    be known. The statistic is the greatest over three widths of ::

        e(u) = sum_h |sum_k d_k r_k exp(2 pi j k u)|^2 / sum_k d_k^2 / m,

    with the residual r and its median energy m more than four tooth passes away from the strongest place, where that is
    above that of noise.
    """
    if not change.bands:
        return nothing(change)
    values = pulse_energy(change)
    ratio = values.max(axis=0) / change.middle
    limit = noise_limit(float(len(change.bands)), _WIDTHS_THAT_DIFFER * INDEPENDENT * change.teeth)
    return Statistic(value=ratio / limit, best=values.argmax(axis=0), ratio=ratio)


def pulse_energy(change: Change) -> FloatArray:
    """Return the energy (3, 8 Z) of pulses of the three widths at each place, before it is divided by the median."""
    return np.array([energies.sum(axis=0) for energies in _energies_of_bands(change)])


def _energies_of_bands(change: Change) -> Iterator[FloatArray]:
    """Yield the energy (bands, 8 Z) of a pulse in each band, of each width."""
    Z = change.teeth
    for width in WIDTHS:
        shapes = [
            np.exp(-0.5 * ((band.orders - band.harmonic * Z) * np.pi / Z * width) ** 2) / band.deviation
            for band in change.bands
        ]
        parts = [shape * band.residual for shape, band in zip(shapes, change.bands, strict=True)]
        powers = np.array([np.sum(shape**2) for shape in shapes])
        yield envelopes(change, parts) / powers[:, None]


def pulse_evidence(change: Change) -> FloatArray:
    """Return the logarithm (8 Z,) of the density of a change with a pulse at each place, over that of noise.

    In noise the energy e of a pulse in a band follows the exponential law. A pulse with a complex normal amplitude in
    that band, whose mean energy is v, changes its density by the factor ``exp(e v / (1 + v)) / (1 + v)``. Half of the
    bands show the pulse, in the same size v. Sizes and widths are equally likely. So the mean of the density ratio is 1
    in noise, which makes it as large as 1000 once in 1000 or more seldom.

    The energy is relative to what the other teeth show in its band, as in :func:`template_statistic`.
    """
    if not change.bands:
        return np.zeros(PLACES * change.teeth)
    noise = excess(change, change.others)[:, None]
    size = _SIZES[:, None, None]
    logs = []
    for energies in _energies_of_bands(change):
        shown = energies / noise * size / (1 + size) - np.log1p(size)
        logs.append(np.logaddexp(np.log(1 - _SHOWN), np.log(_SHOWN) + shown).sum(axis=1))
    return np.asarray(logsumexp(logs, axis=(0, 1)) - np.log(len(WIDTHS) * len(_SIZES)))


def template_statistic(change: Change, templates: BehindPath) -> Statistic:
    """Return the likelihood ratio of damage to none at each place of the turn, over the misfit that it leaves.

    In each band the difference D of a template from its healthy rig, turned by u, is fitted with a free complex
    amplitude: the path and the model's stiffness need not be right, only the shape of the difference about a mesh
    harmonic. With the residual r and its deviation s, its energy R, and the degrees of freedom f that are left, the
    statistic is the greatest over templates of ::

        F(u) = sum_h w_h e_h(u) / max(1, (R - sum_h e_h(u)) / f),
        e_h(u) = |sum_k (D_k / s_k)^* r_k exp(2 pi j k u)|^2 / S_h,    S_h = sum_k |D_k / s_k|^2,

    relative to the limit of noise. The weights ``w_h = c S_h / (1 + c S_h)`` are those of amplitudes of the expected
    size, where c makes the sum of all c S_h 50, the energy of damage that is just seen. So bands in which the damage is
    far below the noise behind the path take no part. The sum of weighted exponential laws is approximated by a gamma
    law with the same mean and variance [1]_.

    A path that changed leaves more in some bands than in others. So r^2 and S_h are divided by the median energy of the
    other teeth in their band, where that is more than noise. The template that fits best is taken out before: it makes
    a gear of few teeth ring over much of the turn, which is no property of the other teeth.

    Parameters
    ----------
    change
        Change of the run.
    templates
        Shapes of the templates behind the path.

    References
    ----------
    .. [1] Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics Bulletin 2(6),
       1946, doi:10.2307/3002019.
    """
    if not change.bands:
        return nothing(change)
    shapes = [templates.shapes[:, band.orders] / band.deviation for band in change.bands]
    powers = np.array([np.sum(np.abs(shape) ** 2, axis=1) for shape in shapes])
    if not np.all(powers.sum(axis=0) > 0):
        return nothing(change)
    parts = [np.conj(shape) * band.residual for shape, band in zip(shapes, change.bands, strict=True)]
    energy = envelopes(change, parts) / np.maximum(powers, np.finfo(float).tiny)[:, :, None]
    levels = np.array([band.level for band in change.bands])
    free = partial(
        _template_values,
        degrees=change.degrees - len(change.bands),
        tries=len(templates.shapes) * INDEPENDENT * change.teeth,
    )
    value, _ = free(energy, powers, levels)
    best, place = np.unravel_index(int(np.argmax(value)), value.shape)
    rest = without_shape(change, [shape[best] for shape in shapes], int(place))
    m = excess(rest, change.others)
    value, ratio = free(energy / m[:, None, None], powers / m[:, None], levels / m)
    best_of = value.argmax(axis=0)
    places = np.arange(value.shape[1])
    return Statistic(value=value[best_of, places], best=best_of, ratio=ratio[best_of, places])


def _template_values(
    energy: FloatArray, powers: FloatArray, levels: FloatArray, *, degrees: int, tries: float
) -> tuple[FloatArray, FloatArray]:
    """Return F (S, 8 Z) relative to the limit of noise, and F itself.

    Parameters
    ----------
    energy
        (bands, S, 8 Z) e_h(u) of each template.
    powers, levels
        (bands, S) S_h, and (bands,) energy of the residual.
    degrees
        Degrees of freedom that a template leaves.
    tries
        Number of independent values.
    """
    expected = powers * (_EXPECTED / powers.sum(axis=0))
    weight = expected / (1 + expected)
    misfit = np.maximum(1.0, (levels.sum() - energy.sum(axis=0)) / max(degrees, 1))
    ratio = np.asarray((weight[:, :, None] * energy).sum(axis=0) / misfit)
    scale = (weight**2).sum(axis=0) / weight.sum(axis=0)
    shapes = weight.sum(axis=0) / scale
    limits = scale * np.interp(shapes, *_limit_curve(len(powers), tries))
    return np.asarray(ratio / limits[:, None]), ratio


def without_shape(change: Change, shape: Sequence[ComplexArray], place: int) -> Change:
    """Return a change without a shape, which has a free complex amplitude in each band.

    Parameters
    ----------
    change
        The change.
    shape
        The shape (K,) over the deviation in each band.
    place
        Its place, in eighths of a tooth pass.
    """
    bands = []
    for band, part in zip(change.bands, shape, strict=True):
        T = part * np.exp(-2j * np.pi * band.orders * place / (PLACES * change.teeth))
        power = float(np.sum(np.abs(T) ** 2))
        fitted = np.sum(np.conj(T) * band.residual) / power * T if power > 0 else 0.0
        bands.append(replace(band, residual=band.residual - fitted))
    return replace(change, bands=tuple(bands))


def left_by_damage(run: AverageSpectrum, healthy: AverageSpectrum, *, turn: float) -> float:
    """Return the mean square of what the healthy average and one short pulse leave of another average; 1 for noise.

    In each band about a mesh harmonic the spectrum X, over its deviation, is fitted by ``g H + a P(u)``, with the
    healthy spectrum H, turned, and a pulse P at the place u of the turn. Both amplitudes are complex and free in each
    band. The place and one of three widths are those that leave least in all bands together. So a damaged tooth biases
    no gain.

    Parameters
    ----------
    run, healthy
        Spectra of two averages of the same length.
    turn
        Turn of the healthy average.
    """
    Z, healthy = run.teeth, healthy.turned(turn)
    bands = orders_of_bands(Z, run.samples, highest_common(run, healthy))
    left = np.zeros((len(WIDTHS), PLACES * Z))
    for h, k in bands:
        s = np.sqrt(np.maximum(run.variance[k] + healthy.variance[k], np.finfo(float).tiny))
        X, H = run.mean[k] / s, healthy.mean[k] / s
        D = np.exp(-0.5 * ((k - h * Z) * np.pi / Z * np.array(WIDTHS)[:, None]) ** 2) / s
        power = np.sum(D**2, axis=1, keepdims=True)
        PX, PH = (_along(D * each, k - h * Z, PLACES * Z) / np.sqrt(power) for each in (X, H))
        rest = np.sum(np.abs(H) ** 2) - np.abs(PH) ** 2
        cross = np.vdot(H, X) - np.conj(PH) * PX
        left += np.sum(np.abs(X) ** 2) - np.abs(PX) ** 2 - np.abs(cross) ** 2 / np.maximum(rest, np.finfo(float).tiny)
    return float(left.min()) / max(sum(len(k) - 2 for _, k in bands), 1)


def _along(values: ComplexArray, orders: IntArray, places: int) -> ComplexArray:
    """Return ``sum_k values_k exp(2 pi j k u)`` (..., places) over the turn."""
    line = np.zeros((*values.shape[:-1], places), complex)
    line[..., orders % places] = values
    return np.asarray(ifft(line, axis=-1) * places)
