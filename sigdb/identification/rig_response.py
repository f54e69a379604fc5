"""Numbers of a rig that targets refer to, computed once for each rig and only where a target needs them."""

from dataclasses import dataclass, field
from functools import cached_property

from sigdb.transmission import Compliance, CoupledModes, Transmission, coupled_modes, static_compliance


@dataclass(frozen=True)
class RigResponse:
    """A rig with its modes and deflections, which are computed when they are first needed.

    Attributes
    ----------
    rig
        The transmission.
    """

    rig: Transmission
    _modes: dict[float | None, CoupledModes] = field(default_factory=dict, init=False, repr=False)

    def modes(self, speed_rpm: float | None = None) -> CoupledModes:
        """Return the modes at a speed, or at that of the rig."""
        if speed_rpm not in self._modes:
            rig = self.rig if speed_rpm is None else self.rig.replace({"operating.speed_rpm": speed_rpm})
            self._modes[speed_rpm] = coupled_modes(rig)
        return self._modes[speed_rpm]

    @property
    def motions(self) -> list[str]:
        """Motions of the rig, by name."""
        return list(self.modes().moves[0])

    @cached_property
    def compliance(self) -> Compliance:
        """The static compliance at the sensors."""
        return static_compliance(self.rig)

    def deflection(self, sensor: str, force_at: str | None, force: float | None) -> float:
        """Return the static displacement that a sensor sees, m, under a force along a sensor, or the rig's torque."""
        names = list(self.rig.sensors)
        here = names.index(sensor)
        if force_at is None or force is None:
            return float(self.compliance.torque[here])
        return float(force * self.compliance.forces[here, names.index(force_at)])
