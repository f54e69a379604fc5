"""Nuisances: what is not known of a machine and its measurement, as normal changes of the clean average.

The section ``[nuisance]`` of a recipe states how large each one is. To first order a nuisance adds a column times a
standard normal number to the average; the columns of all nuisances together are its modes.
"""

from collections.abc import Iterator, Mapping
from functools import lru_cache

import numpy as np
from pydantic import Field, field_validator

from sigdb.core import FloatArray, Section, quantity

NEPER_DB = 20 / np.log(10)
"""Decibels in a natural logarithm of 1."""

MOST_MODES = 256
"""Modes of a template at most, and numbers that a row draws for them."""

_LEAST_MODE = 5e-4
"""Least norm of a mode that is kept, over the norm of the healthy average."""

_LEAST_EIGENVALUE = 1e-3
"""Least variance of a component of a smooth path that is kept, over the greatest one."""


class NuisanceSettings(Section):
    """Settings of nuisances; none is there by default. Numbers are standard deviations, or limits where they say so."""

    gain_db: float = quantity("dB", "Standard deviation of the gain of the sensor.", ge=0, default=0.0)
    path_db: float = quantity(
        "dB", "Standard deviation of the gain of the path to the sensor, at any order.", ge=0, default=0.0
    )
    path_deg: float = quantity(
        "deg", "Standard deviation of the phase of the path to the sensor, at any order.", ge=0, default=0.0
    )
    path_orders: float = quantity(
        "1/rev", "Distance of two orders whose gains in the path are correlated with exp(-1/2).", gt=0, default=2.0
    )
    mark: float = quantity(
        "-", "Standard deviation of the place of the tacho mark, in tooth passes.", ge=0, default=0.0
    )
    modulation: float = quantity(
        "-", "Standard deviation of the sine and of the cosine by which the shaft modulates the average.", ge=0,
        default=0.0,
    )  # fmt: skip
    index_error: float = quantity(
        "m", "Standard deviation of index errors beyond those of [measurement].", ge=0, default=0.0
    )
    speed: float = quantity("-", "Greatest relative error of the speed.", ge=0, lt=0.5, default=0.0)
    torque: float = quantity("-", "Greatest relative error of the torque.", ge=0, lt=0.5, default=0.0)
    rig: float = quantity(
        "-", "Greatest relative error of each assumed number of the rig, inside its range.", ge=0, lt=1, default=0.0
    )
    profile: float = quantity("m", "Greatest profile deviation, more or less, of all teeth.", ge=0, default=0.0)
    rigs: int = quantity("-", "Rigs that are drawn for errors of speed, torque, rig and profile.", ge=2, default=64)
    sources: Mapping[str, str] = Field(default={}, description="Where each of these numbers comes from, by its name.")

    @field_validator("sources")
    @classmethod
    def _name_numbers(cls, sources: Mapping[str, str]) -> Mapping[str, str]:
        for name in sources:
            if name not in cls.model_fields or name == "sources":
                raise ValueError(f"sources.{name} is of no number of this section; name one of them")
        return sources

    @property
    def of_machine(self) -> bool:
        """Whether there are nuisances whose effect must be simulated."""
        return any((self.speed, self.torque, self.rig, self.profile))

    @property
    def exist(self) -> bool:
        """Whether there are any nuisances."""
        measured = (self.gain_db, self.path_db, self.path_deg, self.mark, self.modulation, self.index_error)
        return self.of_machine or any(measured)


def measured_columns(signal: FloatArray, teeth: int, settings: NuisanceSettings) -> FloatArray:
    """Return the change of an average per standard deviation of each nuisance of its measurement.

    Parameters
    ----------
    signal
        (n,) clean average.
    teeth
        Tooth count of the averaged gear.
    settings
        Sizes of the nuisances. Its errors of machine and teeth do not count here.

    Returns
    -------
    (n, columns) float64
        In the unit of the signal.
    """
    return np.column_stack([np.empty((len(signal), 0)), *_measured(signal, teeth, settings)])


def _measured(signal: FloatArray, teeth: int, settings: NuisanceSettings) -> Iterator[FloatArray]:
    """Yield (n,) or (n, columns) of each nuisance."""
    n, spectrum = len(signal), np.fft.rfft(signal)
    if settings.gain_db:
        yield settings.gain_db / NEPER_DB * signal
    for factor in (settings.path_db / NEPER_DB, 1j * np.radians(settings.path_deg)):
        if factor:
            smooth = smooth_components(len(spectrum), settings.path_orders)
            yield np.fft.irfft(factor * spectrum[:, None] * smooth, n, axis=0)
    if settings.mark:
        late = 2 * np.pi * settings.mark / teeth
        yield np.fft.irfft(-1j * late * np.arange(len(spectrum)) * spectrum, n)
    if settings.modulation:
        angle = 2 * np.pi * np.arange(n) / n
        yield settings.modulation * signal[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


@lru_cache(8)
def smooth_components(orders: int, distance: float) -> FloatArray:
    """Return components of a random smooth function of the order with a variance of 1, (orders, components).

    Its covariance is ``exp(-(k - l)^2 / (2 distance^2))``. Times independent standard normal numbers the components add
    up to such a function.
    """
    apart = np.subtract.outer(np.arange(orders), np.arange(orders)) / distance
    variance, vectors = np.linalg.eigh(np.exp(-(apart**2) / 2))
    kept = variance > _LEAST_EIGENVALUE * variance[-1]
    return np.asarray(vectors[:, kept] * np.sqrt(variance[kept]))


def principal_modes(columns: FloatArray, scale: FloatArray) -> FloatArray:
    """Return few orthogonal columns with nearly the same covariance.

    Parameters
    ----------
    columns
        (sensors, n, columns) changes of averages per standard deviation, in the units of the sensors.
    scale
        (sensors,) root mean square of the healthy average of each sensor.

    Returns
    -------
    (sensors, n, modes) float64
        The greatest first, without those whose norm is below 1 / 2000 of that of the healthy averages.
    """
    sensors, n, _ = columns.shape
    relative = (columns / scale[:, None, None]).reshape(sensors * n, -1)
    left, spread, _ = np.linalg.svd(relative, full_matrices=False)
    kept = spread[:MOST_MODES] > _LEAST_MODE * np.sqrt(sensors * n)
    modes = (left * spread)[:, :MOST_MODES][:, kept]
    return np.asarray(modes.reshape(sensors, n, -1) * scale[:, None, None])
