"""Modes of nuisances: how the averages of templates change with what is not known of machine and measurement.

Changes by the measurement follow from the template alone. Errors of speed, torque, rig and tooth profile are simulated
on rigs that are drawn from what is stated.
"""

from collections.abc import Iterator, Mapping
from typing import TypeAlias

import numpy as np

from sigdb.core import FloatArray, InputError, IntArray, SigdbError, nuisance_stream, validated
from sigdb.dynamics import PeriodicRig, SteadyState, prepare_periodic
from sigdb.measurement import (
    MOST_MODES,
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


_NODES = 6
"""Places inside an interval at which an error of one number is simulated: exact for changes up to its fifth power."""

Drawn: TypeAlias = tuple[float, PeriodicRig]
"""A rig with errors, and the root of its weight."""


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
        self._each = plan.nuisance.each
        self._stated = _prepare(plan, point.rig) if plan.nuisance.of_machine else None
        self._drawn = [_drawn(plan, point.rig, settings) if settings.of_machine else () for settings in self._each]
        self._sensors = [list(plan.rig.sensors).index(sensor) for sensor in plan.sensors]

    def of(
        self, damage: Mapping[int, ToothDamage], state: SteadyState, reference_variance: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        """Return the modes of a case, (sensors, n, modes), and how many each nuisance has.

        Parameters
        ----------
        damage
            Damage of its teeth, by number.
        state
            Its steady state at the rig point.
        reference_variance
            (sensors,) variance of the healthy averages of the stored sensors.
        """
        stated = np.zeros(1) if self._stated is None else self._signals(self._stated, damage)
        scale, most = np.sqrt(reference_variance), MOST_MODES // max(1, len(self._each))
        modes = []
        for settings, drawn in zip(self._each, self._drawn, strict=True):
            columns = [
                *(root * (self._signals(rig, damage) - stated)[:, :, None] for root, rig in drawn),
                *self._errors(settings, state),
                *self._measured(settings, state.signals[self._sensors]),
            ]
            modes.append(principal_modes(np.concatenate(columns, axis=2), scale, most))
        empty = np.empty((*state.signals[self._sensors].shape, 0))
        return np.concatenate([empty, *modes], axis=2), np.array([each.shape[2] for each in modes], int)

    def _signals(self, rig: PeriodicRig, damage: Mapping[int, ToothDamage]) -> FloatArray:
        return np.asarray(rig.steady_state([damage], specimens=False).signals[0][self._sensors])

    def _errors(self, settings: NuisanceSettings, state: SteadyState) -> Iterator[FloatArray]:
        """Yield the changes by further index errors, (sensors, n, errors)."""
        if settings.index_error:
            teeth, mate = self._point.teeth, self._point.mate_teeth
            covariance = index_error_covariance(teeth, mate, runout=self._plan.design.runout)
            yield settings.index_error * independent_responses(state.specimen_response[self._sensors], covariance)

    def _measured(self, settings: NuisanceSettings, signals: FloatArray) -> Iterator[FloatArray]:
        """Yield the changes by the measurement, of each sensor apart: paths differ from sensor to sensor."""
        common = settings.model_copy(update={"gain_db": 0.0, "path_db": 0.0, "path_deg": 0.0})
        of_sensor = settings.model_copy(update={"modulation": 0.0})
        yield np.stack([measured_columns(signal, self._point.teeth, common) for signal in signals])
        for i, signal in enumerate(signals):
            columns = measured_columns(signal, self._point.teeth, of_sensor)
            apart = np.zeros((len(signals), *columns.shape))
            apart[i] = columns
            yield apart


def _prepare(plan: Plan, rig: Transmission) -> PeriodicRig:
    """Return a rig on the grid that all share, so that their differences have no error of the grid."""
    return prepare_periodic(rig, gear=plan.gear, samples_per_tooth=plan.signature.samples_per_tooth, refine=False)


def _drawn(plan: Plan, rig: Transmission, settings: NuisanceSettings) -> list[Drawn]:
    """Return rigs with the errors of one nuisance: drawn for those of the rig, at nodes for those of one number."""
    if settings.rig:
        drawn = _prepared(plan, rig, settings)
        return [(float(1 / np.sqrt(len(drawn))), each) for each in drawn]
    places, weights = np.polynomial.legendre.leggauss(_NODES)
    errors = [_with_error(rig, plan.gear, settings, place) for place in places.tolist()]
    roots = np.sqrt(weights / weights.sum()).tolist()
    return [(root, _prepare(plan, each)) for root, each in zip(roots, errors, strict=True)]


def _prepared(plan: Plan, rig: Transmission, settings: NuisanceSettings) -> list[PeriodicRig]:
    """Return as many drawn rigs as the plan asks for, prepared, without those that cannot be."""
    prepared: list[PeriodicRig] = []
    stream = nuisance_stream(plan.seed)
    for _ in range(_MOST_TRIES * settings.rigs):
        try:
            drawn = _prepare(plan, _another(rig, settings.rig, stream))
            if not drawn.steady_state([{}], specimens=False).contact_loss[0]:
                prepared.append(drawn)
        except SigdbError:
            continue
        if len(prepared) == settings.rigs:
            return prepared
    raise InputError(
        f"nuisance: only {len(prepared)} of {_MOST_TRIES * settings.rigs} drawn rigs have a steady state, and "
        f"{settings.rigs} are needed; reduce rig"
    )


def _another(rig: Transmission, share: float, stream: np.random.Generator) -> Transmission:
    """Return a rig whose assumed numbers each differ by up to a share, inside their ranges."""
    values = rig.assumptions.values_of(rig)
    domains = {number.path: number.domain for number in rig.assumptions.free}
    changed: dict[str, float | str] = {}
    for (path, value), error in zip(values.items(), stream.uniform(-1, 1, len(values)), strict=True):
        if isinstance(domain := domains[path], Range) and isinstance(value, float | int):
            changed[path] = float(np.clip(value * (1 + share * error), domain.low, domain.high))
    return rig.with_assumed(changed) if changed else rig


def _with_error(rig: Transmission, gear: str, settings: NuisanceSettings, error: float) -> Transmission:
    """Return a rig with an error of its speed, torque or tooth profile, as a part of the greatest one."""
    if settings.profile:
        return with_profile(rig, gear, settings.profile * error)
    operating = {
        "operating.speed_rpm": rig.operating.speed_rpm * (1 + settings.speed * error),
        "operating.torque": rig.operating.torque * (1 + settings.torque * error),
    }
    return rig.replace(operating)


def with_profile(rig: Transmission, gear: str, amplitude: float) -> Transmission:
    """Return a rig with a further profile deviation, m, of the meshes of a gear."""
    data = rig.model_dump()
    for name in rig.meshes_of(gear):
        present = rig.meshes[name].profile_error
        data["meshes"][name]["profile_error"] = {"amplitude": amplitude + (present.amplitude if present else 0.0)}
    return validated(Transmission, data, owner=f"rig {rig.name!r} with another profile")
