"""Spectrum of an average, with the variance of each order between groups of its revolutions."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.ndimage import median_filter

from sigdb.core import ComplexArray, FloatArray, InputError, IntArray
from sigdb.recording import RecordedSignature

LEAST_GROUPS = 6
"""Least number of groups of revolutions from which a variance is estimated."""

_NEIGHBOURS = 9
"""Orders whose median variance an order has at least: few groups give some orders a variance near zero by chance."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AverageSpectrum:
    """Spectrum of an average.

    Attributes
    ----------
    source
        The recording.
    groups
        (G, n / 2 + 1) spectra of the averages of groups of revolutions.
    spread
        (n / 2 + 1,) variance of one group about the mean.
    teeth, samples
        Tooth count Z, and samples n of the average.
    highest_order
        Highest order that the recording holds.
    """

    source: str
    groups: ComplexArray
    spread: FloatArray
    teeth: int
    samples: int
    highest_order: float

    @classmethod
    def of(cls, signature: RecordedSignature) -> Self:
        """Return the spectrum of a signature.

        Raises
        ------
        InputError
            If there are fewer than six revolutions.
        """
        G, n = signature.groups.shape
        if G < LEAST_GROUPS:
            raise InputError(
                f"{signature.source}: {G} revolutions are too few to tell a change from noise; record {LEAST_GROUPS} or"
                " more"
            )
        groups = np.fft.rfft(signature.groups, axis=1)
        variance = groups.var(axis=0, ddof=1)
        return cls(
            source=signature.source,
            groups=groups,
            spread=np.maximum(variance, median_filter(variance, _NEIGHBOURS, mode="nearest")),
            teeth=signature.teeth,
            samples=n,
            highest_order=signature.highest_order,
        )

    @cached_property
    def mean(self) -> ComplexArray:
        """(n / 2 + 1,) spectrum of the average."""
        return np.asarray(self.groups.mean(axis=0))

    @cached_property
    def variance(self) -> FloatArray:
        """(n / 2 + 1,) variance of the average at each order."""
        return self.spread / len(self.groups)

    def turned(self, turn: float) -> Self:
        """Return the spectrum of the average that begins later by a part of a revolution."""
        return replace(self, groups=self.groups * np.exp(2j * np.pi * turn * np.arange(self.groups.shape[1])))

    def part(self, numbers: IntArray) -> Self:
        """Return the spectrum of some groups; their spread is that of all of them."""
        return replace(self, groups=self.groups[numbers])

    def plus(self, addition: ComplexArray) -> Self:
        """Return the spectrum with an addition (n / 2 + 1,) to every revolution."""
        return replace(self, groups=self.groups + addition)
