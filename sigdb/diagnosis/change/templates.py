"""Templates: averages of rigs that may be the recorded one, undamaged and with damage at tooth 1."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, ComplexArray, FloatArray, IntArray
from sigdb.database import QUANTITIES
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.change import MODULATION
from sigdb.diagnosis.change.path import path_gain
from sigdb.dynamics import prepare_periodic
from sigdb.measurement import NuisanceMixture
from sigdb.transmission import Damage, Transmission, as_damage

if TYPE_CHECKING:
    from sigdb.recognition import TemplateBank

CASES = (
    *({"stiffness_loss": loss} for loss in (0.05, 0.1, 0.2, 0.4, 0.6, 0.8)),
    {"stiffness_loss": 0.2, "damaged_teeth": 2},
    {"stiffness_loss": 0.5, "damaged_teeth": 2},
    {"phase_shift_deg": 1.5},
)
"""Damage of the templates that are simulated for a recording."""

MOST_MACHINES = 7
"""Machines with nuisances whose templates are added to each stored one, at most."""

_MOST_STORED = 1024
"""Stored templates, those of machines with nuisances included, where each has more than one."""

_OF_SOUND_GEAR = 0.05
"""Share of the energy of a nuisance's change of the healthy average between the mesh harmonics, above which it is of
the gear's teeth."""

_ALIKE = 0.9
"""Share of its energy, as a mean over the bands, that a template has in common with one that stands for it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Templates:
    """Templates of one or more rigs for one gear, sensor and operating point.

    Attributes
    ----------
    teeth, samples
        Tooth count Z, and samples n of an average.
    healthy
        (members, n / 2 + 1) spectra of the undamaged rigs.
    spectra
        (T, n / 2 + 1) differences of the spectra with damage from those without.
    member
        (T,) rig of each template.
    severity
        ``stiffness_loss``, ``phase_shift_deg`` and ``damaged_teeth`` of each template.
    last
        (T,) whether greater losses of its kind were left out, since the mesh opens.
    described
        Whether the rig is described, so that its templates say how severe a damage is; not only its tooth counts.
    """

    teeth: int
    samples: int
    healthy: ComplexArray
    spectra: ComplexArray
    member: IntArray
    severity: pd.DataFrame
    last: BoolArray
    described: bool

    @classmethod
    def simulated(
        cls,
        rigs: Sequence[Transmission],
        *,
        gear: str,
        sensor: str,
        samples_per_tooth: int,
        described: bool,
    ) -> Self:
        """Simulate the templates of rigs; those whose mesh opens are left out, since the linear solution is none there.

        Parameters
        ----------
        rigs
            Rigs at the recording's operating point.
        gear, sensor
            Names of the averaged gear and the sensor.
        samples_per_tooth
            Samples of an average in a tooth pass.
        described
            Whether the rig is described.
        """
        teeth = rigs[0].gears[gear].teeth
        coarse = min(samples_per_tooth, 32)
        damages = [as_damage({"tooth": 1, "gear": gear, **case}) for case in CASES]
        healthy, spectra, member, cases, last = [], [], [], [], []
        for number, rig in enumerate(rigs):
            prepared = prepare_periodic(rig, gear=gear, samples_per_tooth=coarse, refine=False)
            states = prepared.steady_state([{}, *(damage.on_teeth(teeth) for damage in damages)], specimens=False)
            signals = states.signals_at()[:, list(rig.sensors).index(sensor)]
            X = _resampled(signals, teeth * samples_per_tooth)
            healthy.append(X[0])
            opens = states.contact_loss[1:]
            for case, damage in enumerate(damages, 1):
                if not opens[case - 1]:
                    spectra.append(X[case] - X[0])
                    member.append(number)
                    cases.append([getattr(damage, name) for name in QUANTITIES])
                    last.append(_next_opens(damages, opens, case - 1))
        return cls(
            teeth=teeth,
            samples=teeth * samples_per_tooth,
            healthy=np.array(healthy),
            spectra=np.array(spectra),
            member=np.array(member, int),
            severity=pd.DataFrame(cases, columns=list(QUANTITIES)),
            last=np.array(last, bool),
            described=described,
        )

    @classmethod
    def stored(cls, bank: "TemplateBank", *, speed_rpm: float, torque: float, teeth: int) -> Self:
        """Return the templates of a database or a model at an operating point.

        Where the database states nuisances, templates of machines that have them are added to each of its own.
        """
        point = (np.array([value]) for value in (speed_rpm, torque, teeth))
        ((local, _, coefficients),) = bank.locals(*point)
        X = np.fft.rfft(local.signals(coefficients)[0], axis=1)
        damaged = ~local.healthy
        spectra = (X[damaged] - X[local.healthy][0])[None]
        nuisances = bank.nuisances(speed_rpm, torque, teeth)
        if nuisances is not None:
            modes = np.fft.rfft(nuisances.modes, axis=1)
            changes = _changes(modes, nuisances.counts, nuisances.mixture, healthy=local.healthy, teeth=teeth)
            spectra = np.concatenate([spectra, spectra + changes])
        machines, stored, _ = spectra.shape
        severity = pd.DataFrame(local.severity[damaged], columns=list(QUANTITIES))
        return cls(
            teeth=teeth,
            samples=local.samples,
            healthy=np.repeat(X[local.healthy][:1], machines, axis=0),
            spectra=spectra.reshape(machines * stored, -1),
            member=np.repeat(np.arange(machines), stored),
            severity=pd.concat([severity] * machines, ignore_index=True),
            last=np.zeros(machines * stored, bool),
            described=True,
        )

    def behind(self, healthy: AverageSpectrum, *, absolute: bool) -> "BehindPath":
        """Return the templates behind the path to the sensor that a healthy average shows.

        Parameters
        ----------
        healthy
            Healthy spectrum, turned to the run.
        absolute
            Whether the averages begin at a tacho mark. If not, they begin anywhere in a tooth pass, and each rig's
            templates are delayed by less than half a tooth pass, to the phase of its first mesh harmonic.
        """
        k, Z = np.arange(healthy.groups.shape[1]), self.teeth
        simulated, spectra = self.healthy, self.spectra
        if not absolute:
            phase = np.angle(healthy.mean[Z] * np.conj(simulated[:, Z])) / Z
            delay = np.exp(1j * phase[:, None] * k)
            simulated, spectra = simulated * delay, spectra * delay[self.member]
        gain = np.array([path_gain(healthy, each) for each in simulated])
        return BehindPath(templates=self, spectra=spectra * gain[self.member])


@dataclass(frozen=True, kw_only=True, eq=False)
class BehindPath:
    """Templates as the sensor of a recording would show them.

    Attributes
    ----------
    templates
        The templates.
    spectra
        (T, n / 2 + 1) their differences behind the path.
    """

    templates: Templates
    spectra: ComplexArray

    @cached_property
    def shapes(self) -> ComplexArray:
        """(S, n / 2 + 1) as few of the differences as resemble all of them, apart from a gain in each band.

        Each template has at least nine tenths of its energy in common with one of them, as a mean over the bands.
        """
        Z = self.templates.teeth
        alike = np.zeros((len(self.spectra), len(self.spectra)))
        counted = 0
        for h in range(1, self.templates.samples // (2 * Z)):
            k = np.arange(h * Z - Z // 2, h * Z + (Z + 1) // 2)
            part = np.where(k % Z > 0, self.spectra[:, k], 0)
            power = np.sum(np.abs(part) ** 2, axis=1)
            if np.all(power > 0):
                alike += np.abs(part @ part.conj().T) ** 2 / np.outer(power, power)
                counted += 1
        alike /= max(counted, 1)
        chosen: list[int] = []
        missing = np.ones(len(self.spectra), bool)
        while missing.any():
            best = int(np.argmax(np.sum((alike >= _ALIKE) & missing, axis=1) * missing))
            chosen.append(best)
            missing &= alike[best] < _ALIKE
            missing[best] = False
        return self.spectra[chosen]


def _changes(
    modes: ComplexArray, counts: Sequence[int], mixture: NuisanceMixture, *, healthy: BoolArray, teeth: int
) -> ComplexArray:
    """Draw changes of the spectra of damaged templates by nuisances, (machines, T, n / 2 + 1).

    Healthy recordings of the machine show how its nuisances change the sound gear. So index errors are left out, and so
    are the mesh harmonics: a change is how the damage looks different in another machine.

    Parameters
    ----------
    modes
        (templates, n / 2 + 1, modes) spectra of the modes, those of each nuisance together.
    counts
        Number of modes of each nuisance.
    mixture
        Which nuisances a machine has.
    healthy
        (templates,) whether a template is of a healthy gear.
    teeth
        Tooth count Z.
    """
    orders = np.arange(modes.shape[1])
    between = np.minimum(orders % teeth, -orders % teeth) > MODULATION
    sound = np.abs(modes[healthy][0]) ** 2
    number = np.repeat(np.arange(len(counts)), counts)
    total, far = (np.bincount(number, each, len(counts)) for each in (sound.sum(axis=0), sound[between].sum(axis=0)))
    cancels = (far > _OF_SOUND_GEAR * total)[number]
    parts = mixture.factors(counts) * ~cancels
    weight = np.array([part.weight for part in mixture.parts]) * parts.any(axis=1)
    damaged = modes[~healthy] * between[:, None]
    machines = int(np.clip(_MOST_STORED // len(damaged) - 1, 1, MOST_MACHINES)) if weight.any() else 0
    stream = np.random.default_rng(0)
    part = stream.choice(len(parts), (machines, len(damaged)), p=weight / weight.sum() if machines else None)
    numbers = stream.standard_normal((*part.shape, len(number))) * parts[part]
    return np.einsum("tkq,mtq->mtk", damaged, numbers)


def _next_opens(damages: Sequence[Damage], opens: BoolArray, number: int) -> bool:
    """Return whether the next greater loss of as many teeth opens the mesh."""
    this = damages[number]
    greater = [
        i
        for i, each in enumerate(damages)
        if each.damaged_teeth == this.damaged_teeth and each.stiffness_loss > this.stiffness_loss > 0
    ]
    return bool(greater) and bool(opens[min(greater, key=lambda i: damages[i].stiffness_loss)])


def _resampled(signals: FloatArray, samples: int) -> ComplexArray:
    """Return the spectra of signals (..., n) for averages of as many samples or more; higher orders are 0."""
    n = signals.shape[-1]
    X = np.fft.rfft(signals, axis=-1)[..., : (n + 1) // 2]
    wide = np.zeros((*X.shape[:-1], samples // 2 + 1), complex)
    wide[..., : X.shape[-1]] = X * (samples / n)
    return wide
