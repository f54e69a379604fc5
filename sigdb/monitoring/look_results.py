"""Results of a look: its difference from the reference of healthy looks, in numbers that are kept."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.diagnosis import (
    USUAL_LAG,
    AverageSpectrum,
    Change,
    HealthySet,
    Power,
    change_from,
    common_change_db,
    power,
    pulse_statistic,
    turn_between,
    without_pulse,
)
from sigdb.monitoring.looks import Look
from sigdb.recording import RecordedSignature
from sigdb.signature import na4_star, nb4_star, residual_signal

_MOST_HEALTHY = 12
"""Most healthy looks of a reference; more are taken in even steps."""


_APART = 3.5
"""Distance from the strongest pulse, in tooth passes, from which on a difference is of the rest of the turn."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LookResults:
    """Numbers of looks, (L,) each.

    Attributes
    ----------
    misfit
        Logarithm of the mean square of the whitened difference from the reference.
    rest
        Logarithm of the median energy over the turn without the strongest pulse and the two and a half tooth passes to
        both of its sides, relative to that of noise.
    pulse
        Logarithm of the greatest energy of a short pulse, relative to the limit of noise and to the rest of the turn.
    tooth
        Tooth of that pulse.
    likeness
        Correlation of the errors of the teeth with those of the reference.
    rms, record_rms
        Rms of the average and of the record without its mean, in the unit of the signal.
    speed_rpm
        Speed of the shaft.
    common_db
        Change of level that all mesh harmonics have in common, dB.
    na4_star, nb4_star
        NA4* of the residual, and NB4* of the envelope about the strongest mesh harmonic, against the healthy looks.
    tooth_map
        (L, Z) mean energy of the difference in each tooth pass, relative to that of noise.
    """

    misfit: FloatArray
    rest: FloatArray
    pulse: FloatArray
    tooth: IntArray
    likeness: FloatArray
    rms: FloatArray
    record_rms: FloatArray
    speed_rpm: FloatArray
    common_db: FloatArray
    na4_star: FloatArray
    nb4_star: FloatArray
    tooth_map: FloatArray

    def __len__(self) -> int:
        return len(self.misfit)

    def take(self, numbers: Sequence[int]) -> "LookResults":
        """Return those of some looks."""
        return LookResults(**{name: values[numbers] for name, values in vars(self).items()})

    @classmethod
    def joined(cls, some: Sequence["LookResults"]) -> "LookResults":
        """Return those of several sets of looks."""
        return cls(**{name: np.concatenate([getattr(each, name) for each in some]) for name in vars(some[0])})


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """Healthy looks of a gear, with which all looks are compared.

    Attributes
    ----------
    looks
        The healthy looks.
    torques
        Torques of them, or loads; None where they are unknown.
    """

    looks: tuple[Look, ...]
    torques: tuple[float | None, ...]

    @classmethod
    def of(cls, looks: Sequence[Look]) -> "Reference":
        """Return the reference of healthy looks: twelve of them at most, in even steps."""
        steps = np.unique(np.linspace(0, len(looks) - 1, min(len(looks), _MOST_HEALTHY)).round().astype(int))
        some = tuple(looks[step] for step in steps)
        by_torque = all(look.torque is not None for look in some)
        return cls(looks=some, torques=tuple(look.torque if by_torque else look.load for look in some))

    @cached_property
    def signatures(self) -> tuple[RecordedSignature, ...]:
        """Signatures of the healthy looks."""
        return tuple(look.read() for look in self.looks)

    @cached_property
    def healthy(self) -> HealthySet:
        """The healthy looks as one set, turned to begin at the same tooth."""
        return HealthySet.of(self.signatures, self.torques)

    def load_of(self, look: Look) -> float | None:
        """Return the torque of a look, or its load, as the reference has it."""
        by_torque = all(each.torque is not None for each in self.looks)
        return look.torque if by_torque else look.load

    def change(self, look: Look, signature: RecordedSignature) -> tuple[Change, AverageSpectrum, AverageSpectrum]:
        """Return the change of a look, its spectrum and that of the reference; a healthy look is left out of it.

        The reference is interpolated where the loads of all are known and differ, and the mean elsewhere.
        """
        healthy = self.healthy
        number = next((i for i, each in enumerate(self.looks) if each.key == look.key), None)
        if number is not None and len(healthy) > 1:
            healthy = healthy.without(number)
        run = AverageSpectrum.of(signature)
        load = self.load_of(look)
        if load is not None and len({*self.torques}) > 1 and None not in self.torques:
            reference, turn, _ = healthy.reference(run, speed_rpm=signature.speed_rpm, torque=load)
        else:
            reference = _pooled([each.spectrum for each in healthy.recordings])
            turn = turn_between(run, reference, absolute=healthy.absolute)
        return change_from(run, reference, turn=turn), run, reference

    def result(self, look: Look) -> LookResults:
        """Return the numbers of one look.

        Raises
        ------
        InputError
            If its revolutions are too few, or it has no band in common with the healthy looks.
        """
        signature = look.read()
        change, run, reference = self.change(look, signature)
        if not change.bands:
            raise InputError(f"{look.name}: no band in common with the healthy recordings; record at a higher rate")
        statistic = pulse_statistic(change)
        averages = np.array([*(each.tsa for each in self.signatures), signature.tsa])
        count, teeth = len(self.signatures), signature.teeth
        rms = float(signature.tsa.std())
        numbers = {
            "misfit": np.log(max(change.misfit, 1e-12)),
            "rest": np.log(max(_rest(change, statistic.place), 1e-12)),
            "pulse": np.log(max(statistic.greatest, 1e-12)),
            "tooth": int(np.floor(statistic.place - USUAL_LAG + 0.5)) % teeth + 1,
            "likeness": change.likeness,
            "rms": rms,
            "record_rms": rms / look.kept if look.kept > 0 else np.nan,
            "speed_rpm": signature.speed_rpm,
            "common_db": common_change_db(run, reference),
            "na4_star": na4_star(residual_signal(averages, teeth=teeth), baseline=count)[-1],
            "nb4_star": nb4_star(averages, teeth=teeth, baseline=count)[-1],
        }
        tooth_map = np.asarray(change.tooth_map * change.middle)[None]
        return LookResults(**{name: np.array([value]) for name, value in numbers.items()}, tooth_map=tooth_map)

    def power(self, limit: float) -> Power:
        """Return the pulses that the newest healthy look would have shown.

        Parameters
        ----------
        limit
            Logarithm of the pulse statistic above which a tooth stands out.
        """
        look, signature = self.looks[-1], self.signatures[-1]
        change, run, reference = self.change(look, signature)

        def decide(spectrum: AverageSpectrum) -> bool:
            return bool(np.log(pulse_statistic(change_from(spectrum, reference, turn=change.turn)).greatest) > limit)

        return power(run, decide, templates=None)


def _rest(change: Change, place: float) -> float:
    """Return the median energy of a change far from a place (tooth passes), after the pulse there is taken out."""
    size = len(change.energy)
    at = round(place * size / change.teeth) % size
    far = np.abs((np.arange(size) - at + size // 2) % size - size // 2) > _APART * size / change.teeth
    return float(np.median(without_pulse(change, at).energy[far]))


def _pooled(spectra: Sequence[AverageSpectrum]) -> AverageSpectrum:
    """Return the spectrum of all groups of revolutions of several averages that begin at the same tooth."""
    return replace(
        spectra[0],
        groups=np.concatenate([each.groups for each in spectra]),
        spread=np.mean([each.spread for each in spectra], axis=0),
        highest_order=min(each.highest_order for each in spectra),
    )
