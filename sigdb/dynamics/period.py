"""The period over which a rig with periodic mesh stiffness repeats, and its damaged gear."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import ComplexArray, FloatArray, InputError
from sigdb.transmission import Transmission

_MOST_REVOLUTIONS = 60
"""Longest common period that is solved; a longer one is refused."""
_NEARLY = 5e-3
"""Relative change of a mesh frequency that counts as small: a twentieth of a resonance's width at 5 % damping."""


@dataclass(frozen=True, kw_only=True)
class Period:
    """The common period of all meshes, on a grid.

    Spectra are those of ``rfft`` over its samples.

    Attributes
    ----------
    samples
        N, samples in it.
    revolutions
        Revolutions of the averaged shaft in it.
    passes
        Tooth passes of each mesh in it.
    refinement
        Samples on the grid for each sample given out.
    """

    samples: int
    revolutions: int
    passes: tuple[int, ...]
    refinement: int = 1

    @property
    def harmonics(self) -> int:
        """K: harmonics 0 to K - 1 are in a spectrum, the last of which may be the Nyquist one and is zero then."""
        return self.samples // 2 + 1

    def sampled(self, spectrum: ComplexArray) -> FloatArray:
        """(..., N, columns) values of a spectrum (..., K, columns)."""
        return np.fft.irfft(spectrum, n=self.samples, axis=-2)

    def averaged(self, spectrum: ComplexArray) -> FloatArray:
        """(..., n, columns) average over the revolutions, without the harmonics that n samples cannot hold."""
        n = self.samples // (self.revolutions * self.refinement)
        held = spectrum[..., : self.revolutions * (n // 2) + 1 : self.revolutions, :]
        if n % 2 == 0:
            held = held.copy()
            held[..., n // 2 :, :] = 0
        return np.fft.irfft(held, n=n, axis=-2) / (self.revolutions * self.refinement)

    def spectrum(self, values: FloatArray) -> ComplexArray:
        """(..., K, columns) spectrum of values (..., F, columns) on a grid of the period, fine or not."""
        F, K = values.shape[-2], self.harmonics
        spectrum = np.fft.rfft(values, axis=-2) * (self.samples / F)
        spectrum[..., (min(F, self.samples) + 1) // 2 :, :] = 0
        if spectrum.shape[-2] >= K:
            return spectrum[..., :K, :]
        whole = np.zeros((*spectrum.shape[:-2], K, spectrum.shape[-1]), complex)
        whole[..., : spectrum.shape[-2], :] = spectrum
        return whole


def over_the_period(kappa: FloatArray, passes: int, F: int) -> FloatArray:
    """(F,) samples over the period of a function given over one pass, without harmonics above F / 2."""
    coefficients = np.fft.rfft(kappa) / len(kappa)
    spectrum = np.zeros(F // 2 + 1, complex)
    places = spectrum[: (F + 1) // 2 : passes]
    count = min(len(places), len(coefficients))
    places[:count] = coefficients[:count]
    return np.fft.irfft(spectrum, n=F) * F


def common_period(rig: Transmission, gear: str) -> tuple[int, tuple[int, ...]]:
    """Least revolutions of a gear in which every mesh makes whole tooth passes, and each mesh's passes in them.

    Raises
    ------
    InputError
        If that takes too many revolutions to be solved.

    Examples
    --------
    >>> import sigdb
    >>> common_period(sigdb.load_transmission("two-stage-gearbox"), "input-pinion")
    (5, (160, 96))
    """
    per_turn = _passes_per_turn(rig, gear)
    for revolutions in range(1, _MOST_REVOLUTIONS + 1):
        passes = revolutions * per_turn
        if np.allclose(passes, np.round(passes), rtol=0, atol=1e-6):
            return revolutions, tuple(round(count) for count in passes)
    raise InputError(
        f"the meshes of rig {rig.name!r} do not repeat within {_MOST_REVOLUTIONS} revolutions; choose tooth counts "
        "with a shorter common period"
    )


def nearest_period(rig: Transmission, gear: str) -> tuple[int, tuple[int, ...]]:
    """Return the revolutions of a gear in which every mesh makes nearly whole tooth passes, and these whole passes.

    It is the common period of a train whose mesh frequencies differ by at most 0.5 %, if there is one that can be
    solved, and else that of the nearest train. Within it, all meshes meet in many relative phases.

    Examples
    --------
    >>> import sigdb
    >>> train = sigdb.new_rig("23/67,19/81", speed="1480 rpm", torque="45 N m")
    >>> nearest_period(train, "pinion-1")
    (2, (46, 13))
    """
    per_turn = _passes_per_turn(rig, gear)
    revolutions = np.arange(1, _MOST_REVOLUTIONS + 1)
    passes = revolutions[:, None] * per_turn
    whole = np.maximum(np.round(passes), 1)
    change = np.abs(whole / passes - 1).max(axis=1)
    row = int(np.argmax(change <= _NEARLY)) if (change <= _NEARLY).any() else int(np.argmin(change))
    return int(revolutions[row]), tuple(int(count) for count in whole[row])


def _passes_per_turn(rig: Transmission, gear: str) -> FloatArray:
    """Return the tooth passes (meshes,) in a revolution of a gear."""
    speed = abs(rig.ratio(rig.gears[gear].shaft))
    driving = [rig.gears[mesh.driving] for mesh in rig.meshes.values()]
    return np.array([each.teeth * abs(rig.ratio(each.shaft)) / speed for each in driving])


def repeats(rig: Transmission, gear: str) -> bool:
    """Return whether the meshes repeat soon enough for a periodic solution; see :func:`common_period`."""
    try:
        common_period(rig, gear)
    except InputError:
        return False
    return True


def check_in_one_mesh(rig: Transmission, gear: str) -> None:
    """Refuse damage and index errors of a gear that takes part in several meshes.

    Raises
    ------
    InputError
        If it does.
    """
    if len(meshes := rig.meshes_of(gear)) > 1:
        raise InputError(
            f"gear {gear!r} of rig {rig.name!r} takes part in {len(meshes)} meshes; damage is simulated in one, and so "
            "are index errors: leave them out, or name a gear of one mesh"
        )


def damaged_gear(rig: Transmission, gear: str | None) -> str:
    """The gear that damage refers to: the one named, or the driving gear of the first mesh.

    Raises
    ------
    InputError
        If the rig has no such gear, or the gear meshes with none.
    """
    if gear is None:
        if not rig.meshes:
            raise InputError(f"rig {rig.name!r} has no mesh, so no gear can be damaged")
        return next(iter(rig.meshes.values())).driving
    if not rig.meshes_of(gear):
        raise InputError(f"gear {gear!r} of rig {rig.name!r} takes part in no mesh; name a gear that does")
    return gear
