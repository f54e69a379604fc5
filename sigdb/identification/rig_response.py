"""Numbers of a rig that targets refer to, computed once for each rig and only where a target needs them."""

from dataclasses import dataclass, field
from functools import cached_property

from sigdb.core import FloatArray, NotApplicableError, UnstableRigError
from sigdb.dynamics import PeriodicRig, damaged_gear, prepare
from sigdb.transmission import Compliance, CoupledModes, Damage, Transmission, coupled_modes, static_compliance


@dataclass(frozen=True)
class RigResponse:
    """A rig with its modes and deflections, which are computed when they are first needed.

    Attributes
    ----------
    rig
        The transmission.
    """

    rig: Transmission
    _elsewhere: dict[tuple[float | None, float | None], "RigResponse"] = field(
        default_factory=dict, init=False, repr=False
    )
    _prepared: dict[str, PeriodicRig] = field(default_factory=dict, init=False, repr=False)

    def at(self, *, speed_rpm: float | None = None, torque: float | None = None) -> "RigResponse":
        """Return the rig at another speed or torque, where they are stated."""
        stated = {"operating.speed_rpm": speed_rpm, "operating.torque": torque}
        values = {path: value for path, value in stated.items() if value is not None}
        if not values:
            return self
        key = (speed_rpm, torque)
        if key not in self._elsewhere:
            self._elsewhere[key] = RigResponse(self.rig.replace(values))
        return self._elsewhere[key]

    @cached_property
    def modes(self) -> CoupledModes:
        """The modes."""
        return coupled_modes(self.rig)

    def gear(self, name: str | None) -> str:
        """Return the name of a gear, of the first one if it is left out."""
        return damaged_gear(self.rig, name)

    @property
    def motions(self) -> list[str]:
        """Motions of the rig, by name."""
        return list(self.modes.moves[0])

    @cached_property
    def compliance(self) -> Compliance:
        """The static compliance at the sensors."""
        return static_compliance(self.rig)

    def average(self, sensor: str, damage: Damage) -> tuple[int, FloatArray | None]:
        """Return a gear's tooth count and its average (n,) with damage; None where its teeth part.

        Raises
        ------
        InputError
            If the damage does not fit the gear, or the torque pulls the teeth apart.
        NotApplicableError
            If the rig has no steady state.
        """
        gear = self.gear(damage.gear)
        if gear not in self._prepared:
            self._prepared[gear] = prepare(self.rig, gear=gear)
        prepared = self._prepared[gear]
        teeth = damage.on_teeth(prepared.teeth)
        try:
            prepared.floquet_multiplier([teeth])
        except UnstableRigError as error:
            raise NotApplicableError(str(error)) from None
        state = prepared.steady_state([teeth], specimens=False)[0]
        row = list(self.rig.sensors).index(sensor)
        return prepared.teeth, None if state.contact_loss else state.signals[row]

    def deflection(self, sensor: str, force_at: str | None, force: float | None) -> float:
        """Return the static displacement that a sensor sees, m, under a force along a sensor, or the rig's torque."""
        names = list(self.rig.sensors)
        here = names.index(sensor)
        if force_at is None or force is None:
            return float(self.compliance.torque[here])
        return float(force * self.compliance.forces[here, names.index(force_at)])
