"""Preparing the periodic problem of a rig: all that its damage does not change."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sigdb.core import ComplexArray, FloatArray, InputError, NotApplicableError
from sigdb.dynamics.excitation import excitation, harmonics, over_a_pass
from sigdb.dynamics.period import Period, common_period, damaged_gear, nearest_period
from sigdb.dynamics.periodic.error_forces import ErrorForces
from sigdb.dynamics.periodic.hill import entries, hill
from sigdb.dynamics.periodic.influences import Influences, sampled_rows
from sigdb.dynamics.periodic.long_period import long_period
from sigdb.dynamics.periodic.periodic import SAMPLES_PER_TOOTH, TOLERANCE, PeriodicRig
from sigdb.dynamics.periodic.truncation import truncation, twice
from sigdb.transmission import (
    Mesh,
    ModalSystem,
    Transmission,
    meshes_among,
    modal_system,
    nonlinear_among,
    pair_stiffness,
    pairs_in_contact,
    small_matrices,
    static_forces,
)

_MOST_ENTRIES = 40_000_000
"""Complex numbers in the factors of a healthy rig; one that has more is solved by iteration."""
_MOST_REFINEMENT = 8
_HEALTHY_SHARE = 0.25
"""Part of the tolerance that the healthy rig may take; damage with sharp edges needs the rest."""


@small_matrices
def prepare_periodic(
    rig: Transmission,
    *,
    gear: str | None = None,
    samples_per_tooth: int = SAMPLES_PER_TOOTH,
    system: ModalSystem | None = None,
    refine: bool = True,
    nearest: bool = False,
) -> PeriodicRig:
    """Prepare the periodic problem of a gear: all that its damage does not change.

    Parameters
    ----------
    rig
        A transmission with torque through its meshes.
    gear
        The damaged gear; the driving gear of the first mesh if left out.
    samples_per_tooth
        Samples in a tooth pass; n is this times the gear's teeth.
    system
        The rig's modal system, for example a truncated one; synthesised in full if left out.
    refine
        Whether the grid is made finer until the healthy rig's error is a quarter of the tolerance. The error is
        estimated either way.
    nearest
        Whether to solve the nearest train whose meshes repeat soon, in place of a refusal; see
        :func:`~sigdb.dynamics.period.nearest_period`.

    Returns
    -------
    PeriodicRig

    Raises
    ------
    NotApplicableError
        If the rig has an element whose law of force is not linear.
    InputError
        If the rig has no such gear, no torque, a mesh whose teeth the torque pulls apart, or meshes that do not repeat
        within a reasonable time.

    Examples
    --------
    >>> import sigdb
    >>> healthy = prepare_periodic(sigdb.load_transmission("nasa-spiral-bevel")).steady_state([{}])
    >>> healthy.signals.shape, bool(healthy.min_compression[0] > 0)
    ((1, 2, 768), True)
    """
    gear = damaged_gear(rig, gear)
    if rig.operating.drive is None or not rig.operating.torque or not rig.operating.speed_rpm:
        raise InputError(
            f"rig {rig.name!r} has no torque through its meshes; give operating.drive, load, speed and torque"
        )
    main = rig.meshes_of(gear)
    names = sorted(rig.meshes, key=lambda name: name != main[0])
    order = [list(rig.meshes).index(name) for name in names]
    meshes, m = tuple(rig.meshes[name] for name in names), len(names)
    revolutions, passes = (nearest_period if nearest else common_period)(rig, gear)
    teeth, shaft = rig.gears[gear].teeth, rig.gears[gear].shaft
    n, speed = samples_per_tooth * teeth, abs(rig.speed(shaft))
    period = Period(samples=n * revolutions, revolutions=revolutions, passes=tuple(passes[i] for i in order))

    system = system or modal_system(rig)
    if nonlinear := nonlinear_among(system.elements):
        raise NotApplicableError(
            f"rig {rig.name!r} has elements that are not linear, for which there is no periodic solution "
            f"({', '.join(element.name for element in nonlinear)}); simulate with solver=sigdb.Transient()"
        )
    excitations = tuple(
        replace(harmonic, error=harmonic.error[order]) for harmonic in harmonics(rig, system, shaft, revolutions)
    )
    passes_of = [over_a_pass(mesh) for mesh in meshes]
    varying = [(stiffness - mesh.stiffness, force) for mesh, (stiffness, force) in zip(meshes, passes_of, strict=True)]
    means = np.array([mesh.stiffness for mesh in meshes])
    errors = ErrorForces.of(meshes, period.passes, teeth, n, revolutions)
    while True:
        transfer = _transfer(system, order, period, speed)
        loaded = transfer[0, :m, m].real
        static = static_forces(rig, names, loaded)
        inputs = [*range(m), *meshes_among(system.elements)[order[0]].columns[1:]]
        by_iteration = nearest or entries(period) > _MOST_ENTRIES  # a nearest train has passes with few common factors
        solver = (long_period if by_iteration else hill)(transfer[:, :, inputs], [k for k, _ in varying], period)
        free, force = excitation(period, meshes, teeth, excitations, transfer)
        force = np.concatenate([force, np.zeros((2, *force.shape[1:]))])
        response = solver.respond(force, free)
        beyond = truncation(_transfer(system, order, twice(period), speed)[:, :m, inputs], varying, period)
        prepared = PeriodicRig(
            rig=rig,
            system=system,
            gear=gear,
            teeth=teeth,
            meshes=meshes,
            order=tuple(order),
            base_pitch=rig.geometries[main[0]].base_pitch,
            shaft_speed=speed,
            period=period,
            samples=n,
            harmonics=excitations,
            static_compression=np.where(static == means * loaded, loaded, static / means),
            static_force=static,
            healthy=_healthy_stiffness(meshes, period),
            error_forces=errors,
            excitation=(free, force),
            solver=solver,
            truncation=beyond,
            response=sampled_rows(response, m, period),
            error=np.nan,
            influences=Influences(solver, m, period),
        )
        prepared = replace(prepared, error=prepared.healthy_error())
        fine = prepared.error < _HEALTHY_SHARE * TOLERANCE or period.refinement >= _MOST_REFINEMENT
        if fine or not refine:
            return prepared
        period = twice(period)


def _transfer(system: ModalSystem, order: Sequence[int], period: Period, speed: float) -> ComplexArray:
    """(K, outputs, inputs) at the harmonics of a period, the meshes in that order."""
    m = len(order)
    outputs, inputs = [*order, *range(m, len(system.outputs))], [*order, *range(m, system.inputs.shape[1])]
    transfer = system.transfer(speed / period.revolutions * np.arange(period.harmonics))[:, outputs][:, :, inputs]
    if period.samples % 2 == 0:
        transfer[-1] = 0
    return transfer


def _healthy_stiffness(meshes: tuple[Mesh, ...], period: Period) -> FloatArray:
    u = np.arange(period.samples) / period.samples
    return np.array(
        [
            mesh.stiffness * pair_stiffness(mesh.profile, pairs_in_contact(mesh.profile, count * u)).sum(axis=0)
            for mesh, count in zip(meshes, period.passes, strict=True)
        ]
    )
