"""Surroundings of a synthetic recording: drifts of speed and torque, and a field for each other disturbance."""

from typing import Self

import numpy as np
from pydantic import model_validator

from sigdb.core import InputError, Section, quantity
from sigdb.dynamics import TimeProfile
from sigdb.recording.synthetic.sensors import Noise, SensorResonance, Tacho
from sigdb.recording.synthetic.tones import BearingTones, ShaftTones

_POINTS_A_PERIOD = 64
"""Straight lines in a period: they follow a sine within 0.12 % of its amplitude."""


class Drift(Section):
    """Speed or torque relative to the operating point: ``1 + offset + depth sin(2 pi t / period + phase)``.

    The sine represents slow changes by a drive's controller or a load; its form is assumed. In the tests that the
    built-in spiral bevel rig models, speed was held within 6 % and load within 18 % (published: Choy et al., Tribology
    International 29(1), 1996, doi:10.1016/0301-679X(95)00037-2).

    Examples
    --------
    >>> import numpy as np
    >>> drift = Drift(offset=0.01, depth=0.02, period=0.5)
    >>> drift.profile(1000.0, duration=1.0)(np.array([0.0, 0.125])).round(6).tolist()
    [1010.0, 1030.0]
    """

    offset: float = quantity("-", "Constant difference, as a fraction of the operating point's value.", default=0.0)
    depth: float = quantity("-", "Amplitude of the slow sine, as the same fraction.", ge=0, default=0.0)
    period: float = quantity("s", "Period of the slow sine.", gt=0, default=1.0)

    @model_validator(mode="after")
    def _stays_above_zero(self) -> Self:
        if not self.offset - self.depth > -1:
            raise InputError(
                f"offset = {self.offset:g} and depth = {self.depth:g} let the value fall to zero or below; keep offset "
                "- depth above -1"
            )
        return self

    def profile(self, nominal: float, *, duration: float, phase: float = 0.0) -> TimeProfile:
        """Return the value over time.

        Parameters
        ----------
        nominal
            Value at the operating point, in any unit.
        duration
            Duration of the drift, s; the value is constant after it.
        phase
            Phase of the sine at time 0, rad.
        """
        periods = np.ceil(duration / self.period) if self.depth else 0.0
        t = np.linspace(0.0, periods * self.period, int(periods) * _POINTS_A_PERIOD + 1)
        share = 1 + self.offset + self.depth * np.sin(2 * np.pi * t / self.period + phase)
        return TimeProfile(t.tolist(), (nominal * share).tolist())


class Surroundings(Section):
    """Disturbances of a recording; by default there are none, and the tacho gives one exact pulse per revolution.

    Mesh, tones and bearings pass the sensor's path; noise is added behind it. Backlash and loss of contact need no
    switch: the march in time always includes them.

    Examples
    --------
    >>> surroundings = Surroundings(noise=Noise(snr_db=-25.0), speed=Drift(depth=0.01, period=0.5))
    >>> surroundings.path is None
    True
    """

    speed: Drift | None = quantity("-", "Speed relative to the operating point; constant if left out.", default=None)
    torque: Drift | None = quantity("-", "Torque relative to the operating point; constant if left out.", default=None)
    shafts: tuple[ShaftTones, ...] = quantity("-", "Tones of other shafts.", default=())
    bearings: tuple[BearingTones, ...] = quantity("-", "Tones of damaged bearings.", default=())
    path: SensorResonance | None = quantity("-", "Path to the sensor; direct if left out.", default=None)
    noise: Noise | None = quantity("-", "Noise of the recording; none if left out.", default=None)
    tacho: Tacho = quantity("-", "The tacho.", default=Tacho())
