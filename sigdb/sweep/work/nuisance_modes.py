"""Modes of nuisances: how the averages of templates change with what is not known of machine and measurement.

Changes by the measurement follow from the template alone. Errors of speed, torque, rig and tooth profile are simulated
on rigs that are drawn from what is stated.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from sigdb.core import FloatArray, InputError, SigdbError, nuisance_stream, validated
from sigdb.dynamics import PeriodicRig, SteadyState, prepare_periodic
from sigdb.measurement import (
    NuisanceSettings,
    independent_responses,
    index_error_covariance,
    measured_columns,
    principal_modes,
)
from sigdb.sweep.plan.plan import Plan, RigPoint
from sigdb.transmission import Range, ToothDamage, Transmission

_MOST_TRIES = 4
"""Draws for each rig, after which a rig point has none."""


class NuisanceModes:
    """The modes of a plan's nuisances at a rig point.

    Parameters
    ----------
    plan
        The plan.
    point
        The rig point.

    Raises
    ------
    InputError
        If too few of the drawn rigs can be.
    """

    def __init__(self, plan: Plan, point: RigPoint) -> None:
        self._plan, self._point = plan, point
        self._rigs = [_prepare(plan, point.rig), *_prepared(plan, point.rig)] if plan.nuisance.of_machine else []
        self._sensors = [list(plan.rig.sensors).index(sensor) for sensor in plan.sensors]

    def of(self, damage: Mapping[int, ToothDamage], state: SteadyState, reference_variance: FloatArray) -> FloatArray:
        """Return the modes of a case, (sensors, n, modes).

        Parameters
        ----------
        damage
            Damage of its teeth, by number.
        state
            Its steady state at the rig point.
        reference_variance
            (sensors,) variance of the healthy averages of the stored sensors.
        """
        signals = state.signals[self._sensors]
        signals_of = [rig.steady_state([damage], specimens=False).signals[0][self._sensors] for rig in self._rigs]
        drawn = [(each - signals_of[0])[:, :, None] / np.sqrt(len(signals_of) - 1) for each in signals_of[1:]]
        columns = np.concatenate([*drawn, *self._errors(state), *self._measured(signals)], axis=2)
        return principal_modes(columns, np.sqrt(reference_variance))

    def _errors(self, state: SteadyState) -> Iterator[FloatArray]:
        """Yield the changes by further index errors, (sensors, n, errors)."""
        if self._plan.nuisance.index_error:
            teeth, mate = self._point.teeth, self._point.mate_teeth
            covariance = index_error_covariance(teeth, mate, runout=self._plan.design.runout)
            response = state.specimen_response[self._sensors]
            yield self._plan.nuisance.index_error * independent_responses(response, covariance)

    def _measured(self, signals: FloatArray) -> Iterator[FloatArray]:
        """Yield the changes by the measurement, of each sensor apart: paths differ from sensor to sensor."""
        settings = self._plan.nuisance
        common = settings.model_copy(update={"gain_db": 0.0, "path_db": 0.0, "path_deg": 0.0})
        of_sensor = settings.model_copy(update={"mark": 0.0, "modulation": 0.0})
        yield np.stack([measured_columns(signal, self._point.teeth, common) for signal in signals])
        for i, signal in enumerate(signals):
            columns = measured_columns(signal, self._point.teeth, of_sensor)
            apart = np.zeros((len(signals), *columns.shape))
            apart[i] = columns
            yield apart


def _prepare(plan: Plan, rig: Transmission) -> PeriodicRig:
    """Return a rig on the grid that all share, so that their differences have no error of the grid."""
    return prepare_periodic(rig, gear=plan.gear, samples_per_tooth=plan.signature.samples_per_tooth, refine=False)


def _prepared(plan: Plan, rig: Transmission) -> list[PeriodicRig]:
    """Return as many drawn rigs as the plan asks for, prepared, without those that cannot be."""
    prepared: list[PeriodicRig] = []
    stream, settings = nuisance_stream(plan.seed), plan.nuisance
    for _ in range(_MOST_TRIES * settings.rigs):
        try:
            drawn = _prepare(plan, _with_errors(rig, plan.gear, settings, stream))
            if not drawn.steady_state([{}], specimens=False).contact_loss[0]:
                prepared.append(drawn)
        except SigdbError:
            continue
        if len(prepared) == settings.rigs:
            return prepared
    raise InputError(
        f"nuisance: only {len(prepared)} of {_MOST_TRIES * settings.rigs} drawn rigs have a steady state, and "
        f"{settings.rigs} are needed; reduce the errors of rig, speed, torque or profile"
    )


def _with_errors(rig: Transmission, gear: str, settings: NuisanceSettings, stream: np.random.Generator) -> Transmission:
    """Return a rig with errors of its assumed numbers, speed, torque and tooth profile."""
    assumed, values = rig.assumptions, rig.assumptions.values_of(rig)
    errors = stream.uniform(-1, 1, len(values) + 3)
    at = (
        rig.operating.speed_rpm * (1 + settings.speed * errors[-1]),
        rig.operating.torque * (1 + settings.torque * errors[-2]),
    )
    if settings.rig:
        domains = {number.path: number.domain for number in assumed.free}
        changed = {
            path: float(np.clip(value * (1 + settings.rig * error), domain.low, domain.high))
            for (path, value), error in zip(values.items(), errors, strict=False)
            if isinstance(domain := domains[path], Range) and isinstance(value, float | int)
        }
        rig = rig.with_assumed(changed)
    rig = rig.replace({"operating.speed_rpm": at[0], "operating.torque": at[1]})
    return with_profile(rig, gear, settings.profile * errors[-3]) if settings.profile else rig


def with_profile(rig: Transmission, gear: str, amplitude: float) -> Transmission:
    """Return a rig with a further profile deviation, m, of the meshes of a gear."""
    data = rig.model_dump()
    for name in rig.meshes_of(gear):
        present = rig.meshes[name].profile_error
        data["meshes"][name]["profile_error"] = {"amplitude": amplitude + (present.amplitude if present else 0.0)}
    return validated(Transmission, data, owner=f"rig {rig.name!r} with another profile")
