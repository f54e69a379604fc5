"""Nuisances: what is not known of a machine and its measurement, as normal changes of the clean average.

The section ``[nuisance]`` of a recipe states how large each one is. To first order a nuisance adds columns times
standard normal numbers to the average; few columns with nearly the same covariance are its modes. The place of the mark
is exact instead: it turns the average.
"""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer, model_validator

from sigdb.core import FloatArray, Section, quantity

NEPER_DB = 20 / np.log(10)
"""Decibels in a natural logarithm of 1."""

MOST_MODES = 512
"""Modes of a template at most, and numbers that a row draws for them."""

_LEAST_MODE = 1e-3
"""Least norm of a mode that is kept, over the norm of the healthy average."""

_COLOUR = ("colour_db", "colour_octaves", "colours")

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
    path_orders: tuple[Annotated[float, Field(gt=0)], ...] = Field(
        default=(2.0,),
        min_length=1,
        description="(1/rev) Distances of two orders whose gains in the path are correlated with exp(-1/2), one or "
        "several that may be.",
    )
    mark: float = quantity(
        "-", "Standard deviation of the place of the tacho mark, in tooth passes.", ge=0, lt=0.5, default=0.0
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
    colour_db: float = quantity(
        "dB", "Standard deviation of the level of the noise in any octave of orders, at the same scatter.", ge=0,
        default=0.0,
    )  # fmt: skip
    colour_octaves: float = quantity(
        "-", "Distance of two orders, in octaves, whose levels of noise are correlated with exp(-1/2).", gt=0,
        default=2.0,
    )  # fmt: skip
    colours: int = quantity("-", "Colours of noise that are drawn.", ge=1, default=16)
    rigs: int = quantity("-", "Rigs that are drawn for errors of the rig.", ge=2, default=64)
    none: float = quantity(
        "-", "Probability that a machine has none of the nuisances, and its mark where it is stated.", ge=0, le=1,
        default=0.3,
    )  # fmt: skip
    together: float = quantity(
        "-", "Probability that a machine has all of the nuisances at once; otherwise it has one of them.", ge=0, le=1,
        default=0.1,
    )  # fmt: skip
    twice: float = quantity(
        "-", "Probability that a nuisance is twice as large as is stated here.", ge=0, le=1, default=0.0
    )
    sources: Mapping[str, str] = Field(default={}, description="Where each of these numbers comes from, by its name.")

    @field_validator("sources")
    @classmethod
    def _name_numbers(cls, sources: Mapping[str, str]) -> Mapping[str, str]:
        for name in sources:
            if name not in cls.model_fields or name == "sources":
                raise ValueError(f"sources.{name} is of no number of this section; name one of them")
        return sources

    @field_validator("path_orders", mode="before")
    @classmethod
    def _take_one_distance(cls, value: Any) -> Any:
        if isinstance(value, list):
            return tuple(value)
        return (float(value),) if isinstance(value, float | int) else value

    @model_validator(mode="after")
    def _leave_a_probability(self) -> Self:
        if self.none + self.together > 1:
            raise ValueError(
                f"none = {self.none:g} and together = {self.together:g} add up to more than 1; they are probabilities "
                "of cases that exclude each other"
            )
        return self

    @model_serializer(mode="wrap")
    def _leave_out_later_defaults(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the colour where there is none, and other later defaults, as in recipes of earlier versions."""
        content: dict[str, Any] = dump(self)
        left_out = {*(() if self.colour_db else _COLOUR), *(() if self.twice else ("twice",))}
        return {name: value for name, value in content.items() if name not in left_out}

    @property
    def of_machine(self) -> bool:
        """Whether there are nuisances whose effect must be simulated."""
        return any((self.speed, self.torque, self.rig, self.profile))

    @property
    def each(self) -> tuple[Self, ...]:
        """The settings of each nuisance alone, in order; the mark's place is none of them, and paths are one each."""
        names = [("gain_db",), *(("path_db", "path_deg", orders) for orders in self.path_orders)]
        names += [(name,) for name in ("modulation", "index_error", "speed", "torque", "rig", "profile")]
        alone = []
        for some in names:
            numbers: dict[str, Any] = {name: getattr(self, name) for name in some if isinstance(name, str)}
            if any(numbers.values()):
                numbers |= {"path_orders": some[2:]} if some[2:] else {}
                alone.append(type(self)(rigs=self.rigs, **numbers))
        return tuple(alone)

    @property
    def exist(self) -> bool:
        """Whether there are any nuisances."""
        measured = (self.gain_db, self.path_db, self.path_deg, self.mark, self.modulation, self.index_error)
        return self.of_machine or any(measured) or self.colour_db > 0


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

    Notes
    -----
    A path is ``exp(a + i b)`` with normal a and b; its columns have the covariance of that, and not of its first order.
    """
    return np.column_stack([np.empty((len(signal), 0)), *_measured(signal, teeth, settings)])


def _measured(signal: FloatArray, teeth: int, settings: NuisanceSettings) -> Iterator[FloatArray]:
    """Yield (n,) or (n, columns) of each nuisance."""
    n, spectrum = len(signal), np.fft.rfft(signal)
    if settings.gain_db:
        yield settings.gain_db / NEPER_DB * signal
    if settings.path_db or settings.path_deg:
        for orders in settings.path_orders:
            sizes = settings.path_db / NEPER_DB, float(np.radians(settings.path_deg))
            for factor, smooth in zip((1, 1j), path_components(len(spectrum), orders, *sizes), strict=True):
                yield np.fft.irfft(factor * spectrum[:, None] * smooth, n, axis=0)
    if settings.mark:
        yield settings.mark * late_slope(signal, teeth)
    if settings.modulation:
        angle = 2 * np.pi * np.arange(n) / n
        yield settings.modulation * signal[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def late_slope(signals: FloatArray, teeth: int) -> FloatArray:
    """Return the change of averages (..., n) per tooth pass that the mark comes late."""
    n = signals.shape[-1]
    late = -2j * np.pi / teeth * np.arange(n // 2 + 1)
    return np.asarray(np.fft.irfft(late * np.fft.rfft(signals, axis=-1), n, axis=-1))


def late(signals: FloatArray, passes: FloatArray, teeth: int) -> FloatArray:
    """Return averages (rows, ..., n) whose mark comes late by so many tooth passes (rows,)."""
    n = signals.shape[-1]
    angle = 2 * np.pi / teeth * np.arange(n // 2 + 1) * passes.reshape(-1, *(1,) * (signals.ndim - 1))
    return np.asarray(np.fft.irfft(np.fft.rfft(signals, axis=-1) * np.exp(-1j * angle), n, axis=-1))


@lru_cache(16)
def path_components(orders: int, distance: float, gain: float, phase: float) -> tuple[FloatArray, FloatArray]:
    """Return components of a random path less 1, its real and its imaginary part, (orders, components) each.

    The path is ``exp(a + i b)``. a and b are normal, smooth functions of the order with the covariance ``size^2 exp(-(k
    - l)^2 / (2 distance^2))``. Times independent standard normal numbers the components add up to parts with the second
    moments of the path less 1.

    Parameters
    ----------
    orders
        Number of orders.
    distance
        Distance of two orders whose gains are correlated with exp(-1/2).
    gain, phase
        Sizes of a, nepers, and of b, rad.
    """
    apart = np.subtract.outer(np.arange(orders), np.arange(orders)) / distance
    alike = np.exp(-(apart**2) / 2)
    mean = np.exp((gain**2 - phase**2) / 2)
    with_conjugate = np.exp(gain**2 * (1 + alike) - phase**2 * (1 - alike)) - 2 * mean + 1
    with_itself = np.exp((gain**2 - phase**2) * (1 + alike)) - 2 * mean + 1
    return _components((with_conjugate + with_itself) / 2), _components((with_conjugate - with_itself) / 2)


def _components(covariance: FloatArray) -> FloatArray:
    """Return columns whose products add up to nearly a covariance."""
    variance, vectors = np.linalg.eigh(covariance)
    kept = variance > max(_LEAST_EIGENVALUE * variance[-1], np.finfo(float).tiny)
    return np.asarray(vectors[:, kept] * np.sqrt(variance[kept]))


def principal_modes(columns: FloatArray, scale: FloatArray, most: int = MOST_MODES) -> FloatArray:
    """Return few orthogonal columns with nearly the same covariance.

    Parameters
    ----------
    columns
        (sensors, n, columns) changes of averages per standard deviation, in the units of the sensors.
    scale
        (sensors,) root mean square of the healthy average of each sensor.
    most
        Number of modes at most.

    Returns
    -------
    (sensors, n, modes) float64
        The greatest first, without those whose norm is below 1 / 1000 of that of the healthy averages.
    """
    sensors, n, _ = columns.shape
    relative = (columns / scale[:, None, None]).reshape(sensors * n, -1)
    left, spread, _ = np.linalg.svd(relative, full_matrices=False)
    kept = spread[:most] > _LEAST_MODE * np.sqrt(sensors * n)
    modes = (left * spread)[:, :most][:, kept]
    return np.asarray(modes.reshape(sensors, n, -1) * scale[:, None, None])
