"""Numbers of a rig that targets refer to, computed once for each rig and only where a target needs them."""

from dataclasses import dataclass, field
from functools import cached_property

from sigdb.core import FloatArray, NotApplicableError, UnstableRigError
from sigdb.dynamics import HealthySensitivity, PeriodicRig, damaged_gear, prepare_periodic
from sigdb.transmission import (
    Compliance,
    CoupledModes,
    Damage,
    Equations,
    Sensitivity,
    Transmission,
    equations_of,
    static_compliance,
    synthesise,
)


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
    _signals: dict[tuple[str, Damage], FloatArray | None] = field(default_factory=dict, init=False, repr=False)
    _prepared: dict[str, HealthySensitivity] = field(default_factory=dict, init=False, repr=False)

    def at(self, *, speed_rpm: float | None = None, torque: float | None = None) -> "RigResponse":
        """Return the rig at another speed or torque, where they are stated."""
        stated = {"operating.speed_rpm": speed_rpm, "operating.torque": torque}
        values = {path: value for path, value in stated.items() if value is not None}
        if not values:
            return self
        key = (speed_rpm, torque)
        if key not in self._elsewhere:
            self._elsewhere[key] = self._at(self.rig.replace(values), speed_rpm, torque)
        return self._elsewhere[key]

    def _at(self, rig: Transmission, speed_rpm: float | None, torque: float | None) -> "RigResponse":
        return RigResponse(rig)

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """The modes, from which those of rigs nearby follow."""
        return Sensitivity(synthesise(self.rig))

    @cached_property
    def modes(self) -> CoupledModes:
        """The modes."""
        return self.sensitivity.modes

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
        prepared = self.healthy_sensitivity(damage.gear).prepared
        key = self.gear(damage.gear), damage
        if key not in self._signals:
            self._signals[key] = _signals_with(prepared, damage)
        signals = self._signals[key]
        return prepared.teeth, None if signals is None else signals[self._row(sensor)]

    def nearby(self, rig: Transmission) -> "NearbyResponse":
        """Return the response of a rig whose numbers differ a little, by sensitivities in closed form."""
        return NearbyResponse(rig, self)

    def healthy_sensitivity(self, gear: str | None) -> HealthySensitivity:
        """Return the healthy steady state for a gear, from which those of rigs nearby follow."""
        name = self.gear(gear)
        if name not in self._prepared:
            prepared = prepare_periodic(self.rig, gear=name, system=self.sensitivity.synthesis.system())
            self._prepared[name] = HealthySensitivity(prepared, self.sensitivity)
        return self._prepared[name]

    def _row(self, sensor: str) -> int:
        return list(self.rig.sensors).index(sensor)

    def deflection(self, sensor: str, force_at: str | None, force: float | None) -> float:
        """Return the static displacement that a sensor sees, m, under a force along a sensor, or the rig's torque."""
        names = list(self.rig.sensors)
        here = names.index(sensor)
        if force_at is None or force is None:
            return float(self.compliance.torque[here])
        return float(force * self.compliance.forces[here, names.index(force_at)])


def _signals_with(prepared: PeriodicRig, damage: Damage) -> FloatArray | None:
    """Return the signals (sensors, n) of a damaged gear; None where its teeth part."""
    teeth = damage.on_teeth(prepared.teeth)
    try:
        prepared.floquet_multiplier([teeth])
    except UnstableRigError as error:
        raise NotApplicableError(str(error)) from None
    state = prepared.steady_state([teeth], specimens=False)[0]
    return None if state.contact_loss else state.signals_at()


@dataclass(frozen=True)
class NearbyResponse(RigResponse):
    """The response of a rig whose numbers differ a little from those of another, to first order.

    Attributes
    ----------
    base
        The response of the other rig.
    """

    base: RigResponse
    _nearby: dict[str, FloatArray] = field(default_factory=dict, init=False, repr=False)

    def _at(self, rig: Transmission, speed_rpm: float | None, torque: float | None) -> RigResponse:
        return NearbyResponse(rig, self.base.at(speed_rpm=speed_rpm, torque=torque))

    @cached_property
    def _equations(self) -> Equations:
        return equations_of(self.rig)

    @cached_property
    def modes(self) -> CoupledModes:
        """The modes."""
        return self.base.sensitivity.modes_nearby(self._equations)

    def average(self, sensor: str, damage: Damage) -> tuple[int, FloatArray | None]:
        """Return a gear's tooth count and its average (n,); None where the teeth of the other rig part.

        Only the average without damage is to first order; see :meth:`RigResponse.average`.
        """
        teeth, before = self.base.average(sensor, damage)
        if before is None or any(tooth.is_damage for tooth in damage.on_teeth(teeth).values()):
            return super().average(sensor, damage)
        gear = self.gear(damage.gear)
        if gear not in self._nearby:
            self._nearby[gear] = self.base.healthy_sensitivity(gear).signals_nearby(self._equations)
        return teeth, self._nearby[gear][self._row(sensor)]
