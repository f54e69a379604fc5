"""Excitations of a rig other than its varying stiffness: torque, tooth errors, unbalance, run-out, a fluctuating load.

All of it is expressed over the angle theta of the averaged shaft. The average contains an excitation of another shaft
only where that shaft turns a whole number of times in the common period of the meshes; otherwise it cancels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import ComplexArray, FloatArray, InputError, plain_array
from sigdb.dynamics.period import Period
from sigdb.transmission import Mesh, ModalSystem, Transmission, pair_stiffness, pairs_in_contact

SAMPLES_OF_A_PASS = 1024
"""Samples of a tooth pass for the Fourier coefficients of healthy stiffness and errors."""


@dataclass(frozen=True, kw_only=True)
class HarmonicExcitation:
    """Excitations of one order of the averaged shaft: ``Re(force exp(i order theta))``.

    Attributes
    ----------
    order
        Cycles per revolution.
    force
        (inputs,) complex amplitude of each input of the modal system.
    error
        (meshes,) complex amplitude of the error that all tooth pairs of a mesh have in common, m.
    """

    order: float
    force: ComplexArray
    error: ComplexArray


@dataclass(frozen=True, kw_only=True)
class Turning:
    """An excitation that turns with a shaft: unbalance, run-out, a fluctuating load.

    Attributes
    ----------
    harmonic
        Its order of the averaged shaft, whole or not, and its amplitudes at the operating speed.
    inertial
        Whether its force grows with the square of the speed.
    """

    harmonic: HarmonicExcitation
    inertial: bool


def turning(rig: Transmission, system: ModalSystem, shaft: str) -> tuple[Turning, ...]:
    """Return all excitations that turn with a shaft of the rig, by their order of the given shaft."""
    excitations = []

    def add(speed: float, cycles: int = 1, inertial: bool = False) -> HarmonicExcitation:
        harmonic = HarmonicExcitation(
            order=float(cycles * abs(speed / rig.speed(shaft))),
            force=np.zeros(system.inputs.shape[1], complex),
            error=np.zeros(len(rig.meshes), complex),
        )
        excitations.append(Turning(harmonic=harmonic, inertial=inertial))
        return harmonic

    for i, name in enumerate(system.unbalanced):
        cosine = len(rig.meshes) + 2 + 2 * i
        add(rig.speed(name), inertial=True).force[cosine : cosine + 2] = [1.0, -1.0j]
    for i, mesh in enumerate(rig.meshes.values()):
        for gear in (rig.gears[mesh.driving], rig.gears[mesh.driven]):
            if gear.runout:
                add(rig.speed(gear.shaft)).error[i] = gear.runout * np.exp(-1j * np.deg2rad(gear.runout_angle_deg))
    operating = rig.operating
    if operating.load is not None and operating.load_fluctuation:
        angle = operating.load_order * np.deg2rad(operating.load_angle_deg)
        harmonic = add(rig.speed(rig.couplings[operating.load].shaft), operating.load_order)
        harmonic.force[len(rig.meshes) + 1] = operating.load_fluctuation * np.exp(-1j * angle)
    return tuple(excitations)


def harmonics(
    rig: Transmission, system: ModalSystem, shaft: str, revolutions: int = 1
) -> tuple[HarmonicExcitation, ...]:
    """Return the excitations that turn with whole cycles in some revolutions, merged by their order of a shaft."""
    merged: dict[int, HarmonicExcitation] = {}
    for each in turning(rig, system, shaft):
        cycles: float = revolutions * each.harmonic.order
        if bool(np.isclose(cycles, round(cycles))) and round(cycles) != 0:
            other = merged.get(round(cycles))
            merged[round(cycles)] = HarmonicExcitation(
                order=round(cycles) / revolutions,
                force=each.harmonic.force + (other.force if other else 0),
                error=each.harmonic.error + (other.error if other else 0),
            )
    return tuple(merged[cycles] for cycles in sorted(merged))


def checked_index_errors(index_errors: ArrayLike | None, teeth: int) -> FloatArray:
    """Return index errors (teeth,), zero where none are given.

    Raises
    ------
    InputError
        If they are not so many finite numbers.
    """
    errors = np.zeros(teeth) if index_errors is None else plain_array("rig", "index_errors", index_errors, float)
    if errors.shape != (teeth,) or not np.isfinite(errors).all():
        raise InputError(
            f"index_errors must be {teeth} finite numbers, one a tooth of the damaged gear, not an array of "
            f"shape {errors.shape}"
        )
    return errors


def profile_error(mesh: Mesh, x: FloatArray) -> FloatArray:
    """Return the error of a tooth pair's profile at x passes after first contact, m."""
    if mesh.profile_error is None:
        return np.zeros_like(x)
    return mesh.profile_error.amplitude * (2 * x / mesh.profile.contact_ratio - 1) ** 2


def over_a_pass(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """(SAMPLES_OF_A_PASS,) stiffness of a healthy mesh, N/m, and the force of its profile errors, N."""
    x = pairs_in_contact(mesh.profile, np.arange(SAMPLES_OF_A_PASS) / SAMPLES_OF_A_PASS)
    pairs = mesh.stiffness * pair_stiffness(mesh.profile, x)
    return pairs.sum(axis=0), (pairs * profile_error(mesh, x)).sum(axis=0)


def excitation(
    period: Period, meshes: Sequence[Mesh], teeth: int, orders: Sequence[HarmonicExcitation], transfer: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Spectra of all that excites a healthy rig, as columns: torque and profile errors, each tooth's index error along
    the first mesh, each order's two phases.

    Parameters
    ----------
    period
        The common period.
    meshes, teeth
        The meshes, and the teeth of the averaged gear in the first.
    orders
        Harmonic excitations.
    transfer
        (K, outputs, inputs) of the mean system at the harmonics of the period.

    Returns
    -------
    free, force : ndarray, (outputs, K, columns) and (meshes, K, columns)
        ``rfft`` over the period of the outputs that forces cause in the mean system, and of the errors' mesh forces.
    """
    N, m = period.samples, len(meshes)
    K, outputs, _ = transfer.shape
    columns = 1 + teeth + 2 * len(orders)
    free, force = np.zeros((outputs, K, columns), complex), np.zeros((m, K, columns), complex)
    free[:, 0, 0] = N * transfer[0, :, m].real
    passes = [over_a_pass(mesh) for mesh in meshes]
    for i, (count, (_, error)) in enumerate(zip(period.passes, passes, strict=True)):
        _place(force[i, :, 0], N * np.fft.rfft(error) / len(error), count)

    first = _tooth_coefficients(meshes[0], teeth)
    order = np.arange(len(first))
    for tooth in range(teeth):
        turned = first * np.exp(-2j * np.pi * order * tooth / teeth)
        _place(force[0, :, 1 + tooth], N * turned, period.revolutions)

    for i, harmonic in enumerate(orders):
        k = round(harmonic.order * period.revolutions)
        for phase, unit in enumerate((1, 1j)):
            column = 1 + teeth + 2 * i + phase
            free[:, k, column] = N / 2 * unit * (transfer[k] @ harmonic.force)
            for mesh, error in enumerate(harmonic.error):
                if error:
                    stiffness = np.fft.rfft(passes[mesh][0]) / SAMPLES_OF_A_PASS
                    _modulate(force[mesh, :, column], N / 2 * unit * error, k, stiffness, period.passes[mesh])
    return free, force


def _tooth_coefficients(mesh: Mesh, teeth: int) -> ComplexArray:
    """Fourier coefficients over a revolution of the stiffness of tooth 1's pair."""
    n = teeth * SAMPLES_OF_A_PASS
    pair = np.zeros(n)
    x = np.arange(min(n, int(np.ceil(mesh.profile.contact_ratio)) * SAMPLES_OF_A_PASS)) / SAMPLES_OF_A_PASS
    pair[: len(x)] = mesh.stiffness * pair_stiffness(mesh.profile, x)
    return np.fft.rfft(pair) / n


def _place(spectrum: ComplexArray, coefficients: ComplexArray, step: int) -> None:
    """Put coefficients at every ``step``-th harmonic."""
    places = spectrum[::step]
    count = min(len(places), len(coefficients))
    places[:count] = coefficients[:count]


def _modulate(spectrum: ComplexArray, phasor: complex, k: int, coefficients: ComplexArray, step: int) -> None:
    """Add the product of ``2 Re(phasor exp(i k t))`` with a real function that has every ``step``-th harmonic."""
    j = np.arange(1 - len(coefficients), len(coefficients))
    two_sided = np.concatenate([coefficients[:0:-1].conj(), coefficients])
    for carrier, amplitude in ((k, phasor), (-k, np.conj(phasor))):
        at = carrier + step * j
        inside = (at >= 0) & (at < len(spectrum))
        spectrum[at[inside]] += amplitude * two_sided[inside]
