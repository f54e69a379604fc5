"""Observations: an indicator of a damaged gear that is below or above a bound, in sigdb's own indicators."""

from collections.abc import Iterator
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.signal import hilbert

from sigdb.core import FloatArray, InputError, Section, quantity, suggestion
from sigdb.identification.rig_response import RigResponse
from sigdb.signature import INDICATORS, demodulate, indicators
from sigdb.transmission import Damage, Transmission

ALONG = ("envelope", "amplitude", "phase_deg")
"""Quantities along the revolution: the envelope, and the modulations of the mesh's first harmonic."""
_SHARP = 0.01
"""Miss of a bound, as a fraction of it, that counts as one standard deviation of a measurement does."""


class Observation(Section):
    """A statement on the average of a damaged gear: an indicator is below a bound, or above one."""

    text: str = Field(default="", description="The observation in words.")
    sensor: str = Field(description="Sensor whose average is observed.")
    damage: Damage = Field(default=Damage(), description="Damage of the gear, as for `simulate`; none if left out.")
    indicator: str = Field(
        description="Name of an indicator, or along the revolution 'envelope', 'amplitude' (modulation of the mesh "
        "harmonic) or 'phase_deg'."
    )
    from_deg: float = quantity("deg", "Begin of the window along the revolution.", ge=0, le=360, default=0.0)
    to_deg: float = quantity("deg", "End of the window.", ge=0, le=360, default=360.0)
    take: Literal["least", "greatest", "mean"] = Field(
        default="greatest", description="Number of the window that is observed."
    )
    relative_to_healthy: bool = Field(
        default=False, description="Whether the number is divided by that of the gear without damage."
    )
    below: float | None = quantity("-", "Bound below which the number is.", default=None)
    above: float | None = quantity("-", "Bound above which the number is.", default=None)
    held_out: bool = Field(default=False, description="Whether it is predicted instead of searched for.")

    @model_validator(mode="after")
    def _is_a_statement(self) -> Self:
        if (self.below is None) == (self.above is None):
            raise ValueError("give below or above, one of the two, as the bound of the observation")
        if not self.from_deg < self.to_deg:
            raise ValueError(f"from_deg = {self.from_deg:g} must be less than to_deg = {self.to_deg:g}")
        if self.indicator not in (*ALONG, *INDICATORS):
            names = [*ALONG, *INDICATORS]
            raise ValueError(f"indicator = {self.indicator!r} is unknown{suggestion(self.indicator, names)}")
        if self.indicator not in ALONG and (self.from_deg > 0 or self.to_deg < 360):
            raise ValueError(f"indicator = {self.indicator!r} is of the whole average; remove from_deg and to_deg")
        return self

    @property
    def label(self) -> str:
        """The observation in words, or its definition."""
        side, bound = ("below", self.below) if self.below is not None else ("above", self.above)
        return self.text or f"{self.indicator} {side} {bound:g}"

    def check(self, rig: Transmission) -> Iterator[str]:
        """Yield what does not fit a rig."""
        if self.sensor not in rig.sensors:
            yield f"sensor = {self.sensor!r} is no sensor of rig {rig.name!r}{suggestion(self.sensor, rig.sensors)}"
        elif not rig.meshes or not rig.operating.torque:
            yield f"rig {rig.name!r} has no mesh under torque, so no tooth can be damaged; remove the observation"
        else:
            try:
                self.value(RigResponse(rig))
            except InputError as error:
                yield str(error)

    def value(self, response: RigResponse) -> float:
        """Return the observed number of a rig; nan where its teeth part with that damage, or nothing is defined.

        Raises
        ------
        InputError
            If the damage does not fit the rig, or the rig has no steady state.
        """
        teeth, signal = response.average(self.sensor, self.damage)
        if signal is None:
            return np.nan
        number = self._of(signal, teeth)
        if not self.relative_to_healthy:
            return number
        _, healthy = response.average(self.sensor, Damage(gear=self.damage.gear))
        return np.nan if healthy is None else float(np.divide(number, self._of(healthy, teeth)))

    def _of(self, signal: FloatArray, teeth: int) -> float:
        if self.indicator not in ALONG:
            return float(indicators(signal, teeth=teeth)[self.indicator])
        along = _along(self.indicator, signal, teeth)
        angle = np.arange(len(along)) * 360 / len(along)
        window = along[(angle >= self.from_deg) & (angle <= self.to_deg)]
        if self.take == "mean":
            return float(window.mean())
        return float(window.min() if self.take == "least" else window.max())

    def holds(self, value: float) -> bool:
        """Return whether the observation holds for a number; nan does not."""
        return value < self.below if self.below is not None else value > (self.above or 0.0)

    def miss(self, value: float) -> float:
        """Return how far a number is on the wrong side of the bound, in hundredths of it; 0 where it is right."""
        bound = self.below if self.below is not None else (self.above or 0.0)
        over = value - bound if self.below is not None else bound - value
        return float(max(over, 0.0) / (_SHARP * (abs(bound) or 1.0))) if not np.isnan(value) else np.inf


def _along(name: str, signal: FloatArray, teeth: int) -> FloatArray:
    """Return a quantity along the revolution (n,)."""
    if name == "envelope":
        return np.abs(hilbert(signal - signal.mean()))
    amplitude, phase = demodulate(signal, teeth=teeth)
    return amplitude if name == "amplitude" else np.rad2deg(phase)
