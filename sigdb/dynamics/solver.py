"""Solvers of the steady state: the linear periodic solution, the march in time, and one with the other as a fallback.

A solver prepares a rig once for a damaged gear: all that its damage does not change. The prepared rig then
solves any number of cases of damage. A new solver is a class with ``prepare``, and an entry in `SOLVERS` for recipes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np

from sigdb.core import FloatArray, InputError, suggestion
from sigdb.dynamics.march.transient import PreparedMarch, Transient
from sigdb.dynamics.periodic.periodic import LEAST_SAMPLES_PER_TOOTH, SAMPLES_PER_TOOTH, PeriodicRig
from sigdb.dynamics.periodic.prepare import prepare_periodic
from sigdb.dynamics.periodic.steady_state import SteadyState
from sigdb.transmission import ModalSystem, ToothDamage, Transmission

ToothDamages = Mapping[int, ToothDamage]
"""Damage by tooth number, from 1; an empty one is the undamaged gear."""


class Prepared(Protocol):
    """A rig that a solver has prepared for one damaged gear at its operating point."""

    @property
    def gear(self) -> str:
        """Name of the damaged gear."""
        ...

    @property
    def teeth(self) -> int:
        """Tooth count of the damaged gear."""
        ...

    def floquet_multiplier(self, damages: Sequence[ToothDamages]) -> float:
        """Return the largest Floquet multiplier of the linear rig with that damage which leaves the least stiffness.

        Raises
        ------
        UnstableRigError
            If the solver needs a stable rig, and this one is not.
        """
        ...

    def healthy_signals(self) -> FloatArray:
        """Return the signals (sensors, n) of the undamaged rig for gears without index errors."""
        ...

    def steady_state(self, damages: Sequence[ToothDamages], index_errors: FloatArray | None = None) -> SteadyState:
        """Return the steady states of several cases of damage, with a leading axis for them.

        Parameters
        ----------
        damages : sequence of mappings
            Damage by tooth number, from 1, of each case.
        index_errors : ndarray, (teeth,), optional
            Index error of each tooth of the damaged gear, m, for which a case is marched where it is not solved by the
            linear equations; none if left out.
        """
        ...


@runtime_checkable
class Solver(Protocol):
    """A way to find the steady state of a rig.

    Attributes
    ----------
    serves_all_specimens : bool
        Whether the solution of a case that keeps contact holds for any index errors, not only for those requested.
    """

    serves_all_specimens: ClassVar[bool]

    def prepare(self, rig: Transmission, gear: str | None = None, *, system: ModalSystem | None = None) -> Prepared:
        """Prepare a rig for a damaged gear.

        Parameters
        ----------
        rig : Transmission
            A transmission with torque through its meshes.
        gear : str, optional
            The damaged gear; the driving gear of the first mesh if left out.
        system : ModalSystem, optional
            The rig's modal system, for example a truncated one; synthesised in full if left out.

        Raises
        ------
        NotApplicableError
            If the solver does not hold for the rig.
        InputError
            If the rig has no such gear, no torque, or meshes that do not repeat within a reasonable time.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class Periodic:
    """The periodic steady state of the linear, time-periodic rig (no backlash).

    Parameters
    ----------
    samples_per_tooth : int, default 64
        Samples in a tooth pass of the damaged gear.
    """

    serves_all_specimens: ClassVar[bool] = True

    samples_per_tooth: int = SAMPLES_PER_TOOTH

    def __post_init__(self) -> None:
        if self.samples_per_tooth < LEAST_SAMPLES_PER_TOOTH:
            raise InputError(
                f"samples_per_tooth = {self.samples_per_tooth} cannot resolve a tooth pass; give at least "
                f"{LEAST_SAMPLES_PER_TOOTH}, {SAMPLES_PER_TOOTH} is usual"
            )

    def prepare(self, rig: Transmission, gear: str | None = None, *, system: ModalSystem | None = None) -> PeriodicRig:
        """Prepare a rig for a damaged gear; see :class:`Solver`."""
        return prepare_periodic(rig, gear=gear, samples_per_tooth=self.samples_per_tooth, system=system)


@dataclass(frozen=True, kw_only=True)
class PeriodicOrTransient:
    """The periodic steady state where the meshes keep contact, and the march in time where a mesh loses it.

    Parameters
    ----------
    transient : Transient, optional
        The march, whose samples in a tooth pass are those of the periodic solution too.
    """

    serves_all_specimens: ClassVar[bool] = True

    transient: Transient = field(default_factory=Transient)

    def prepare(
        self, rig: Transmission, gear: str | None = None, *, system: ModalSystem | None = None
    ) -> "PreparedPeriodicOrMarch":
        """Prepare a rig for a damaged gear; see :class:`Solver`."""
        linear = Periodic(samples_per_tooth=self.transient.samples_per_tooth).prepare(rig, gear, system=system)
        march = PreparedMarch(
            rig=rig, gear=linear.gear, teeth=linear.teeth, solver=self.transient, system=linear.system, linear=linear
        )
        return PreparedPeriodicOrMarch(linear=linear, march=march)


@dataclass(frozen=True, kw_only=True)
class PreparedPeriodicOrMarch:
    """A rig prepared by :class:`PeriodicOrTransient`: both solutions of it."""

    linear: PeriodicRig
    march: PreparedMarch

    @property
    def gear(self) -> str:
        """Name of the damaged gear."""
        return self.linear.gear

    @property
    def teeth(self) -> int:
        """Tooth count of the damaged gear."""
        return self.linear.teeth

    def floquet_multiplier(self, damages: Sequence[ToothDamages]) -> float:
        """Return the largest Floquet multiplier; see :meth:`PeriodicRig.floquet_multiplier`."""
        return self.linear.floquet_multiplier(damages)

    def healthy_signals(self) -> FloatArray:
        """Return the signals of the undamaged rig by the linear equations; see :class:`Prepared`."""
        return self.linear.healthy_signals()

    def steady_state(self, damages: Sequence[ToothDamages], index_errors: FloatArray | None = None) -> SteadyState:
        """Return the steady states of several cases of damage; see :class:`Prepared`.

        A case whose march fails keeps its linear solution, which does not hold there, with the failure.
        """
        states = self.linear.steady_state(damages, index_errors)
        lost = states.contact_loss_at(index_errors)
        if not lost.any():
            return states
        cases = [
            self._marched(damage, index_errors, states.case(i)) if lost[i] and states.failures[i] is None
            else states.case(i)
            for i, damage in enumerate(damages)
        ]  # fmt: skip
        return SteadyState.stack(cases)

    def _marched(self, damage: ToothDamages, index_errors: FloatArray | None, linear: SteadyState) -> SteadyState:
        marched = self.march.steady_state([damage], index_errors).case(0)
        if marched.failures[0] is not None:
            return replace(linear, failures=marched.failures)
        return replace(marched, least_elsewhere=linear.least_elsewhere, parts_contact=np.asarray(True))


def _periodic(samples_per_tooth: int) -> Periodic:
    return Periodic(samples_per_tooth=samples_per_tooth)


STEPS_PER_SAMPLE = 16
"""Steps of the march for each sample of a tooth pass, where a solver is made by its name."""


def _transient(samples_per_tooth: int) -> Transient:
    return Transient(samples_per_tooth=samples_per_tooth, steps_per_tooth=STEPS_PER_SAMPLE * samples_per_tooth)


def _periodic_or_transient(samples_per_tooth: int) -> PeriodicOrTransient:
    return PeriodicOrTransient(transient=_transient(samples_per_tooth))


SOLVERS: dict[str, Callable[[int], Solver]] = {
    "periodic-or-transient": _periodic_or_transient,
    "periodic": _periodic,
    "transient": _transient,
}
"""Solvers by the name that a recipe gives, as functions of the samples in a tooth pass; the first is the default."""
DEFAULT_SOLVER = next(iter(SOLVERS))


def solver_named(name: str, samples_per_tooth: int) -> Solver:
    """Return a solver by its name in a recipe.

    Parameters
    ----------
    name : str
        One of `SOLVERS`.
    samples_per_tooth : int
        Samples in a tooth pass of the damaged gear.

    Returns
    -------
    Solver

    Raises
    ------
    InputError
        If there is no such solver.

    Examples
    --------
    >>> solver_named("periodic", 32)
    Periodic(samples_per_tooth=32)
    """
    if name not in SOLVERS:
        raise InputError(f"solver = {name!r} is not known{suggestion(name, SOLVERS)}")
    return SOLVERS[name](samples_per_tooth)
