"""The residual of an average in bands about its mesh harmonics, and the energy of short pulses over the turn."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from sigdb.core import ComplexArray, FloatArray, IntArray

PLACES = 8
"""Places of a tooth pass at which the energy of a pulse is computed."""
SIDEBANDS = 2
"""Pairs of sidebands about a mesh harmonic that run-out and an oval pitch curve make, and that are left out."""
NEAR = 2
"""Teeth to either side of a tooth that an event there may reach."""
WIDTHS = (0.4, 0.8, 1.6)
"""Widths of pulses, tooth passes: their spectra fall as ``exp(-(pi s width / Z)^2 / 2)``, s orders from a harmonic."""
MOST_BANDS = 16
"""Largest number of bands."""
_SHARE = 0.85
"""Share of the record's orders that is used."""
_LEAST_WEIGHT = 0.02
"""Weight of a band that noise alone fills."""
_ROUNDING = 1e-28
"""Power of rounding errors, relative to the strongest order."""


@dataclass(frozen=True, eq=False)
class Pulses:
    """The strongest short pulses of turns.

    Attributes
    ----------
    ratio
        (...) energy over that of the other teeth: :meth:`ResidualBands.background`.
    place
        (...) places, in tooth passes after the begin of the revolution.
    width
        (...) widths among those of the search, tooth passes.
    """

    ratio: FloatArray
    place: FloatArray
    width: FloatArray


@dataclass(frozen=True, eq=False)
class ResidualBands:
    """The orders of an average between its mesh harmonics and their first sidebands, in bands about each harmonic.

    Attributes
    ----------
    teeth
        Tooth count Z.
    offsets
        (S,) orders from the mesh harmonic, from -Z/2 to Z/2 without -2 to 2.
    orders
        (H, S) orders of the H bands.
    noise
        (H,) mean power of the average's noise in each band, from the scatter between revolutions.
    floor
        Power of rounding errors.
    """

    teeth: int
    offsets: IntArray
    orders: IntArray
    noise: FloatArray
    floor: float

    @classmethod
    def of(cls, spectra: ComplexArray, *, teeth: int, highest: float) -> Self | None:
        """Return the bands of a record; None if the record holds no complete band.

        Parameters
        ----------
        spectra
            (R, K) spectra of the revolutions, by whole order from 0.
        teeth
            Tooth count Z.
        highest
            Highest order of the record.
        """
        top = int(min(_SHARE * highest, spectra.shape[1] - 1))
        bands = min((top - teeth // 2) // teeth, MOST_BANDS)
        offsets = np.arange(-((teeth - 1) // 2), teeth // 2 + 1)
        offsets = offsets[np.abs(offsets) > SIDEBANDS]
        if bands < 1 or not offsets.size:
            return None
        orders = np.arange(1, bands + 1)[:, None] * teeth + offsets
        each = spectra[:, orders]
        noise = np.mean(np.abs(each - each.mean(axis=0)) ** 2, axis=(0, 2)) / max(len(spectra) - 1, 1)
        strongest = float(np.max(np.abs(spectra.mean(axis=0)) ** 2))
        return cls(teeth, offsets, orders, noise, max(_ROUNDING * strongest, np.finfo(float).tiny))

    @property
    def places(self) -> int:
        """Places of a turn."""
        return PLACES * self.teeth

    def level(self, residual: ComplexArray) -> FloatArray:
        """Return the level of the power of residuals (..., H, S) about each order, in the same shape.

        It is the median of a band over ln 2, the mean of powers of noise, and linear between the middles of the bands.
        """
        middle = np.maximum(np.median(np.abs(residual) ** 2, axis=-1) / np.log(2), self.floor)
        below, above = (np.concatenate(ends, axis=-1) for ends in (
            (middle[..., :1], middle[..., :-1]), (middle[..., 1:], middle[..., -1:])
        ))  # fmt: skip
        share = np.abs(self.offsets) / self.teeth
        beyond = np.where(self.offsets < 0, below[..., None], above[..., None])
        return np.asarray(middle[..., None] * (1 - share) + beyond * share)

    def weight(self, residual: ComplexArray) -> FloatArray:
        """Return the share of each band's power that is not noise, (..., H), of residuals of averages; sum 1."""
        power = np.maximum(np.mean(np.abs(residual) ** 2, axis=-1), self.floor)
        weight = np.maximum(1 - self.noise / power, _LEAST_WEIGHT)
        return np.asarray(weight / weight.sum(axis=-1, keepdims=True))

    def energy(self, white: ComplexArray, weight: FloatArray, width: float) -> FloatArray:
        """Return the energy of pulses at the places of the turn, (..., P), the weighted mean over the bands.

        Parameters
        ----------
        white
            (..., H, S) residuals over the root of their level; where they are noise, the mean energy is 1.
        weight
            (..., H) weights of the bands.
        width
            Width of the pulses, tooth passes.
        """
        from scipy import fft

        pulse = np.exp(-0.5 * (np.pi * self.offsets * width / self.teeth) ** 2)
        spectrum = np.zeros((*white.shape[:-1], self.places), dtype=complex)
        spectrum[..., self.offsets % self.places] = white * (pulse * self.places / np.sqrt(np.sum(pulse**2)))
        power = np.abs(fft.ifft(spectrum, axis=-1, overwrite_x=True)) ** 2
        return np.asarray(np.einsum("...hp,...h->...p", power, weight))

    def pulses(self, residual: ComplexArray) -> Pulses:
        """Return the pulses of residuals (..., H, S) of averages with the greatest ratio of all widths."""
        white, weight = residual / np.sqrt(self.level(residual)), self.weight(residual)
        energies = (self.energy(white, weight, width) for width in WIDTHS)
        ratios = np.stack([energy / self.background(energy) for energy in energies])
        greatest = ratios.max(axis=0).argmax(axis=-1)
        by_width = np.take_along_axis(ratios, greatest[None, ..., None], axis=-1)[..., 0]
        return Pulses(by_width.max(axis=0), greatest / PLACES, np.array(WIDTHS)[by_width.argmax(axis=0)])

    def background(self, energy: FloatArray) -> FloatArray:
        """Return the energy of the other teeth, (..., P), of energies (..., P) over the turn.

        It is the mean over all teeth but five, the tooth of the place and two to either side, at that phase of the
        tooth pass where this mean is greatest: an impact at each tooth's begin does not make an event.
        """
        by_tooth = energy.reshape(*energy.shape[:-1], self.teeth, PLACES)
        near = sum(np.roll(by_tooth, tooth, axis=-2) for tooth in range(-NEAR, NEAR + 1))
        others = (by_tooth.sum(axis=-2, keepdims=True) - near) / (self.teeth - 2 * NEAR - 1)
        return np.repeat(others.max(axis=-1), PLACES, axis=-1)

    def distance(self, place: float) -> FloatArray:
        """Return the distance of the places (P,) from a place, tooth passes."""
        return passes_apart(np.arange(self.places) / PLACES, place, self.teeth)


def passes_apart(places: FloatArray, place: float, teeth: int) -> FloatArray:
    """Return the distances of places from a place on the circle, tooth passes."""
    return np.asarray(np.abs((places - place + teeth / 2) % teeth - teeth / 2))
