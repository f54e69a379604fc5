"""One rig, one damage, one specimen: the response over a revolution of the damaged gear."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, SigdbError, UnstableRigError
from sigdb.dynamics.excitation import checked_index_errors
from sigdb.dynamics.march.transient import Transient, settle
from sigdb.dynamics.periodic.periodic import LEAST_SAMPLES_PER_TOOTH, SAMPLES_PER_TOOTH, PeriodicRig
from sigdb.dynamics.periodic.prepare import prepare
from sigdb.dynamics.stability import floquet_multiplier
from sigdb.transmission import Damage, ToothDamage, Transmission

STABILITY_MODES = 48
"""Modes kept to judge stability: those that take part in the meshes; the others decay by themselves."""


class ContactLossWarning(UserWarning):
    """The mesh loses contact, where a linear solution does not hold."""


@dataclass(frozen=True, kw_only=True)
class Periodic:
    """The periodic steady state of the linear, time-periodic rig (no backlash).

    Attributes
    ----------
    samples_per_tooth
        Samples in a tooth pass of the damaged gear.
    """

    samples_per_tooth: int = SAMPLES_PER_TOOTH

    def __post_init__(self) -> None:
        if self.samples_per_tooth < LEAST_SAMPLES_PER_TOOTH:
            raise InputError(
                f"samples_per_tooth = {self.samples_per_tooth} cannot resolve a tooth pass; give at least "
                f"{LEAST_SAMPLES_PER_TOOTH}, {SAMPLES_PER_TOOTH} is usual"
            )


@dataclass(frozen=True, kw_only=True)
class Response:
    """Response over one revolution of the damaged gear, sample 0 at the tacho mark.

    Where several meshes repeat only after some revolutions, it is the average over them.

    Attributes
    ----------
    gear, damage
        The damaged gear, and its damage.
    signals
        (n,) by sensor, in the unit of ``units``.
    units
        Unit by sensor.
    compression
        (N,) of the damaged gear's mesh along its normal over the common period of all meshes, m.
    min_compression
        Least compression of any mesh as a fraction of its static one. A tooth's own index error, small against the
        static compression, is not subtracted.
    contact_loss
        Whether a mesh loses contact. The linear response does not hold then; that of the march in time does.
    floquet_multiplier
        Largest Floquet multiplier of the linear rig over the common period of its meshes: it is stable below 1.
    error
        Estimated error of the signals by the grid or the step, as a fraction of their peak-to-peak.
    """

    gear: str
    damage: Damage
    signals: dict[str, FloatArray]
    units: dict[str, str]
    compression: FloatArray
    min_compression: float
    contact_loss: bool
    floquet_multiplier: float
    error: float

    def signal(self, sensor: str) -> FloatArray:
        """(n,) signal of a sensor over the revolution.

        Raises
        ------
        InputError
            If the rig has no such sensor.
        """
        if sensor not in self.signals:
            raise InputError(f"no sensor {sensor!r}; known: {', '.join(self.signals)}")
        return self.signals[sensor]


def simulate(
    rig: Transmission,
    damage: Damage | None = None,
    *,
    index_errors: ArrayLike | None = None,
    solver: Periodic | Transient | None = None,
) -> Response:
    """Simulate a rig with damaged teeth at its operating point.

    Parameters
    ----------
    rig
        The transmission.
    damage
        Tooth damage; None for an undamaged gear.
    index_errors
        (teeth,) index error of each tooth of the damaged gear along the mesh normal, m, positive where the tooth
        touches late: the mesh force is ``sum k_p (delta - e_p)``; none if left out.
    solver
        How to solve: :class:`Periodic` if left out, or :class:`Transient`, in which teeth part and come back.

    Returns
    -------
    Response

    Raises
    ------
    InputError
        If damage or index errors do not fit the rig.
    UnstableRigError
        If the varying mesh stiffness makes the rig unstable.
    SigdbError
        If the motion of a rig that loses contact does not repeat.

    Warns
    -----
    ContactLossWarning
        If the mesh loses contact in the periodic solution, which is wrong by order one then.

    Examples
    --------
    >>> import sigdb
    >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
    >>> response = sigdb.simulate(rig, sigdb.Damage(tooth=6, stiffness_loss=0.5))
    >>> response.signal("pinion-vertical").shape
    (768,)
    """
    damage = damage or Damage()
    solver = solver or Periodic()
    if not isinstance(solver, Periodic | Transient):
        raise InputError(f"solver = {solver!r} is no solver; give sigdb.Periodic() or sigdb.Transient()")
    prepared = prepare(rig, gear=damage.gear, samples_per_tooth=solver.samples_per_tooth)
    errors = checked_index_errors(index_errors, prepared.teeth)
    teeth = damage.on_teeth(prepared.teeth)
    if isinstance(solver, Transient):
        return _marched(rig, prepared, damage, teeth, errors, solver)
    state = prepared.steady_state(teeth)
    multiplier = stable_multiplier(rig, prepared, state.mesh_stiffness)
    compression = (
        state.compression + state.compression_response @ errors + state.compression_harmonic[..., 0].sum(axis=1)
    )
    signals = state.signals + state.specimen_response @ errors + state.harmonic_response[..., 0].sum(axis=2)
    least = min(float(compression.min() / state.static_compression), state.least_elsewhere)
    response = Response(
        gear=prepared.gear,
        damage=damage,
        signals=dict(zip(rig.sensors, signals, strict=True)),
        units={name: sensor.unit for name, sensor in rig.sensors.items()},
        compression=compression,
        min_compression=least,
        contact_loss=least < 0,
        floquet_multiplier=multiplier,
        error=state.error,
    )
    if response.contact_loss:
        warnings.warn(
            f"the mesh loses contact (least compression {response.min_compression:.2f} of the static one), where the "
            "linear response does not hold; simulate with solver=sigdb.Transient(), which lets teeth part",
            ContactLossWarning,
            stacklevel=2,
        )
    return response


def _marched(
    rig: Transmission,
    prepared: PeriodicRig,
    damage: Damage,
    teeth: Mapping[int, ToothDamage],
    errors: FloatArray,
    solver: Transient,
) -> Response:
    """The response by the march in time, from the linear steady state."""
    multiplier = _multiplier(prepared, prepared.mesh_stiffness(teeth))
    try:
        orbit = settle(
            rig,
            gear=prepared.gear,
            damage=teeth,
            index_errors=errors,
            state=prepared.modal_state(teeth, errors),
            solver=solver,
            system=prepared.system,
        )
    except SigdbError as error:
        if multiplier < 1:
            raise
        raise UnstableRigError(
            f"{error}; the linear rig is unstable there (Floquet multiplier {multiplier:.3g})"
        ) from None
    return Response(
        gear=prepared.gear,
        damage=damage,
        signals=dict(zip(rig.sensors, orbit.signals, strict=True)),
        units={name: sensor.unit for name, sensor in rig.sensors.items()},
        compression=orbit.compression[0],
        min_compression=orbit.min_compression,
        contact_loss=orbit.contact_loss,
        floquet_multiplier=multiplier,
        error=orbit.error,
    )


def stable_multiplier(rig: Transmission, prepared: PeriodicRig, stiffness: FloatArray) -> float:
    """Largest Floquet multiplier over the common period with that mesh stiffness (meshes, N).

    Raises
    ------
    UnstableRigError
        If it is not below 1.
    """
    multiplier = _multiplier(prepared, stiffness)
    if not multiplier < 1:
        raise UnstableRigError(
            f"rig {rig.name!r} is unstable at {rig.operating.speed_rpm:g} rpm (Floquet multiplier {multiplier:.3g} "
            "over a revolution): the varying mesh stiffness feeds a resonance; raise the damping or change the speed"
        )
    return multiplier


def _multiplier(prepared: PeriodicRig, stiffness: FloatArray) -> float:
    system = prepared.system.truncated(STABILITY_MODES)
    return floquet_multiplier(system, stiffness[np.argsort(prepared.order)], prepared.seconds)
