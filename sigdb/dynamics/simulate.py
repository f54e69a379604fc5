"""One rig, one damage, one specimen: the response over a revolution of the damaged gear."""

import warnings
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from os import PathLike
from typing import Any, overload

from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, SigdbError, UnstableRigError
from sigdb.dynamics.excitation import checked_index_errors
from sigdb.dynamics.period import check_in_one_mesh
from sigdb.dynamics.solver import Periodic, Prepared, Solver
from sigdb.transmission import Damage, Transmission, as_damage, as_transmission, small_matrices

OneDamage = Damage | Mapping[str, Any] | None
"""Tooth damage, or its fields; None for an undamaged gear."""

_KEPT = 8
"""Prepared rigs that are kept."""


class ContactLossWarning(UserWarning):
    """Warning that the mesh loses contact, where a linear solution does not hold."""


class MarchErrorWarning(UserWarning):
    """Warning that a march in time states a greater error than its accuracy allows."""


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
    compression, mesh_force
        (N,) of the damaged gear's mesh along its normal over the common period of all meshes, m and N.
    min_compression
        Least compression of any mesh as a fraction of its static one: that of nominal teeth, from which a tooth's own
        index error is not subtracted.
    min_mesh_force
        Least force of any mesh as a fraction of its static one.
    contact_loss
        Whether a mesh loses contact: it is closed while its force is positive. The linear response does not hold
        without contact, but that of the march in time does.
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
    mesh_force: FloatArray
    min_compression: float
    min_mesh_force: float
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


@dataclass(frozen=True, kw_only=True)
class PreparedRig:
    """A rig prepared for one damaged gear: what its damage does not change is solved once. :func:`prepare` makes it.

    Attributes
    ----------
    rig
        The transmission.
    prepared
        All that the solver computes once.
    """

    rig: Transmission
    prepared: Prepared

    @property
    def gear(self) -> str:
        """Name of the damaged gear."""
        return self.prepared.gear

    @property
    def teeth(self) -> int:
        """Tooth count of the damaged gear."""
        return self.prepared.teeth

    @overload
    def simulate(self, damage: OneDamage = None, *, index_errors: ArrayLike | None = None) -> Response: ...

    @overload
    def simulate(self, damage: Sequence[OneDamage], *, index_errors: ArrayLike | None = None) -> list[Response]: ...

    @small_matrices
    def simulate(
        self, damage: OneDamage | Sequence[OneDamage] = None, *, index_errors: ArrayLike | None = None
    ) -> Response | list[Response]:
        """Simulate the rig with damaged teeth; arguments, result, errors and warnings as of :func:`simulate`.

        Raises
        ------
        InputError
            If the damage names another gear, and as of :func:`simulate`.
        """
        return _responses(lambda _: self, damage, index_errors)

    def _response(self, damage: Damage, index_errors: ArrayLike | None) -> Response:
        """Return the response to one damage."""
        if damage.gear not in (None, self.gear):
            raise InputError(f"gear = {damage.gear!r}, but the rig is prepared for {self.gear!r}; prepare it for that")
        errors = checked_index_errors(index_errors, self.teeth)
        if damage.is_damage or errors.any():
            check_in_one_mesh(self.rig, self.gear)
        teeth = damage.on_teeth(self.teeth)
        multiplier = self.prepared.floquet_multiplier([teeth])
        states = self.prepared.steady_state([teeth], errors)
        _check_stable(states.failures[0], multiplier)
        state = states[0]
        response = Response(
            gear=self.gear,
            damage=damage,
            signals=dict(zip(self.rig.sensors, state.signals_at(errors), strict=True)),
            units={name: sensor.unit for name, sensor in self.rig.sensors.items()},
            compression=state.compression_at(errors),
            mesh_force=state.mesh_force_at(errors),
            min_compression=float(state.least_compression_at(errors)),
            min_mesh_force=float(state.least_mesh_force_at(errors)),
            contact_loss=bool(state.contact_loss_at(errors)),
            floquet_multiplier=multiplier,
            error=float(state.error),
        )
        _warn(response, linear=bool(state.is_linear), accurate=bool(state.meets_accuracy))
        return response


@small_matrices
def prepare(
    rig: Transmission | str | PathLike[str],
    gear: str | None = None,
    *,
    solver: Solver | None = None,
) -> PreparedRig:
    """Prepare a rig for many simulations that differ in the damage of one gear and in index errors.

    Parameters
    ----------
    rig
        The transmission, the name of a built-in one, or a rig file.
    gear
        The damaged gear; the driving gear of the first mesh if left out.
    solver
        How to solve, as of :func:`simulate`.

    Returns
    -------
    PreparedRig
        With :meth:`PreparedRig.simulate`.

    Raises
    ------
    TypeError
        If the rig is of another type.
    InputError
        If the rig has no such gear, or the torque pulls the teeth of a mesh apart.
    UnstableRigError
        If the varying mesh stiffness makes the rig unstable.

    Examples
    --------
    >>> import sigdb
    >>> prepared = sigdb.prepare("nasa-spiral-bevel")
    >>> [prepared.simulate(sigdb.Damage(tooth=6, stiffness_loss=loss)).contact_loss for loss in (0.1, 0.4)]
    [False, False]
    """
    rig, solver = as_transmission(rig), solver or Periodic()
    if not isinstance(solver, Solver):
        raise InputError(f"solver = {solver!r} is no solver; give sigdb.Periodic() or sigdb.Transient()")
    return PreparedRig(rig=rig, prepared=solver.prepare(rig, gear))


@overload
def simulate(
    rig: Transmission | str | PathLike[str],
    damage: OneDamage = None,
    *,
    index_errors: ArrayLike | None = None,
    solver: Solver | None = None,
) -> Response: ...


@overload
def simulate(
    rig: Transmission | str | PathLike[str],
    damage: Sequence[OneDamage],
    *,
    index_errors: ArrayLike | None = None,
    solver: Solver | None = None,
) -> list[Response]: ...


@small_matrices
def simulate(
    rig: Transmission | str | PathLike[str],
    damage: OneDamage | Sequence[OneDamage] = None,
    *,
    index_errors: ArrayLike | None = None,
    solver: Solver | None = None,
) -> Response | list[Response]:
    """Simulate a rig with damaged teeth at its operating point.

    The eight rigs that were used last are kept prepared, by their numbers. So a loop over damages prepares its rig
    once, as :func:`prepare` does.

    Parameters
    ----------
    rig
        The transmission, the name of a built-in one, or a rig file.
    damage
        Tooth damage, or its fields as a dictionary; None for an undamaged gear. A sequence of these gives a list of
        responses.
    index_errors
        (teeth,) index error of each tooth of the damaged gear along the mesh normal, m, positive where the tooth
        touches late: the mesh force is ``sum k_p (delta - e_p)``; none if left out.
    solver
        How to solve: :class:`Periodic` if left out, or :class:`Transient`, in which teeth part and come back.

    Returns
    -------
    Response
        Or a list of one for each damage.

    Raises
    ------
    TypeError
        If the rig or the damage is of another type.
    InputError
        If damage or index errors do not fit the rig, or the torque pulls the teeth of a mesh apart.
    UnstableRigError
        If the varying mesh stiffness makes the rig unstable.
    SigdbError
        If the motion of a rig that loses contact does not repeat.

    Warns
    -----
    ContactLossWarning
        If the mesh loses contact in the periodic solution, which is wrong by order one then.
    MarchErrorWarning
        If the march in time does not meet its accuracy with the most steps that it may take.

    Examples
    --------
    >>> import sigdb
    >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
    >>> response = sigdb.simulate(rig, sigdb.Damage(tooth=6, stiffness_loss=0.5))
    >>> response.signal("pinion-vertical").shape
    (768,)

    Several damages:

    >>> responses = sigdb.simulate(rig, [sigdb.Damage(tooth=6, stiffness_loss=loss) for loss in (0.1, 0.2)])
    >>> [round(each.min_mesh_force, 2) for each in responses]
    [0.58, 0.54]
    """
    rig, solver = as_transmission(rig), solver or Periodic()
    keep = _kept if isinstance(solver, Hashable) else prepare
    return _responses(lambda each: keep(rig, each.gear, solver=solver), damage, index_errors)


_kept: Callable[..., PreparedRig] = lru_cache(maxsize=_KEPT)(prepare)


def _responses(
    prepared_for: Callable[[Damage], PreparedRig],
    damage: OneDamage | Sequence[OneDamage],
    index_errors: ArrayLike | None,
) -> Response | list[Response]:
    """Return the response, or the list of responses, of the rig that is prepared for each damage."""
    if not isinstance(damage, Sequence):
        each = as_damage(damage)
        return prepared_for(each)._response(each, index_errors)
    responses = []
    for each in map(as_damage, damage):
        responses.append(prepared_for(each)._response(each, index_errors))
    return responses


def _warn(response: Response, *, linear: bool, accurate: bool) -> None:
    """Warn where a response does not hold, at the line of the caller of the library."""
    if response.contact_loss and linear:
        warnings.warn(
            f"the mesh loses contact (least mesh force {response.min_mesh_force:.2f} of the static one), where the "
            "linear response does not hold; simulate with solver=sigdb.Transient(), which lets teeth part",
            ContactLossWarning,
            stacklevel=6,
        )
    if not accurate:
        warnings.warn(
            f"the march does not meet its accuracy: its error is {response.error:.2g} of the peak-to-peak; give more "
            "most_steps_per_tooth, or change the damage, the speed or the damping",
            MarchErrorWarning,
            stacklevel=6,
        )


def _check_stable(failure: SigdbError | None, multiplier: float) -> None:
    """Raise the failure of a case as that of an unstable rig, where the rig is unstable."""
    if failure is not None and multiplier >= 1:
        raise UnstableRigError(
            f"{failure}; the linear rig is unstable there (Floquet multiplier {multiplier:.3g})"
        ) from None
