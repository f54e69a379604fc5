"""Signals of the paper's cases for a search: quickly on a coarse grid, and as `sigdb.simulate` makes them.

The rig has one sensor, that of the pinion. The cases that the search must not use are not simulated.
"""

from collections.abc import Sequence

import numpy as np

from sigdb.core import FloatArray
from sigdb.dynamics import prepare_periodic
from sigdb.dynamics.damage_forces import damage_change
from sigdb.paper.identified import GEAR, MESH
from sigdb.paper.margins import TARGET_LOSS, TARGET_SHIFTS
from sigdb.paper.signals import TEETH, TOOTH, PaperSignals
from sigdb.transmission import Mesh, ToothDamage, Transmission, modal_system, pair_stiffness, pairs_in_contact

SHIFTED = tuple({TOOTH: ToothDamage(phase_shift_deg=shift)} for shift in TARGET_SHIFTS)
LOST = {TOOTH: ToothDamage(stiffness_loss=TARGET_LOSS)}
MODES = 12
"""Elastic modes of each rotor in quick signals."""


class QuickResponse:
    """Signals of a rig on a coarse grid, without estimates of their error, for any profile of its mesh.

    The periodic equations are solved by tooth passes: with a healthy mesh the passes differ by their phase alone.
    Damage changes the few samples in contact with it.
    """

    def __init__(self, rig: Transmission, samples: int) -> None:
        self.samples = samples
        system = modal_system(rig, component_modes=MODES)
        omega = abs(rig.speed("pinion-shaft")) * np.arange(TEETH * samples // 2 + 1)
        self.transfer = (1 / (1j * omega[:, None] - system.poles)) @ (system.outputs * system.inputs[:, 0]).T
        self.transfer += system.direct[:, 0]
        i = np.arange(samples)
        lags = (np.arange(TEETH)[:, None, None] * samples + i[:, None] - i) % (TEETH * samples)
        self.blocks = np.fft.fft(np.fft.irfft(self.transfer[:, 0], TEETH * samples)[lags], axis=0)[: TEETH // 2 + 1]
        self.base_pitch = rig.geometries[MESH].base_pitch

    def with_mesh(self, mesh: Mesh) -> "QuickMesh":
        """Return the response with a mesh of the same mean stiffness."""
        return QuickMesh(self, mesh)


class QuickMesh:
    """A quick response with one profile of the mesh."""

    def __init__(self, response: QuickResponse, mesh: Mesh) -> None:
        self.response, self.mesh, self.samples = response, mesh, response.samples
        passing = pairs_in_contact(np.arange(self.samples) / self.samples)
        self.varying = mesh.stiffness * (pair_stiffness(mesh.profile, passing).sum(axis=0) - 1)
        one = np.eye(self.samples)
        self.healthy = np.tile(
            np.linalg.solve(one + response.blocks[0].real * self.varying, np.ones(self.samples)), TEETH
        )
        inverse = np.linalg.solve(one + response.blocks * self.varying, response.blocks)
        self.influence = np.fft.irfft(inverse, TEETH, axis=0)

    def signal(self, damage: dict[int, ToothDamage]) -> tuple[FloatArray, float]:
        """Return the signal (n,) of a case, and the least compression relative to the static one."""
        delta, stiffness = self.healthy, np.tile(self.varying, TEETH)
        if damage:
            change = damage_change(self.mesh, GEAR, TEETH, self.response.base_pitch, damage, self.samples)
            at, added = change.samples, change.stiffness[0]
            passes = (np.arange(TEETH)[:, None, None] - at // self.samples) % TEETH
            columns = self.influence[passes, np.arange(self.samples)[:, None], at % self.samples].reshape(-1, len(at))
            local = np.linalg.solve(np.eye(len(at)) + columns[at] * added, self.healthy[at])
            delta = self.healthy - columns @ (added * local)
            stiffness[at] += added
        force = np.fft.rfft(-stiffness * delta)
        return np.fft.irfft(self.response.transfer[:, 1] * force, TEETH * self.samples), float(delta.min())

    def targets(self) -> PaperSignals:
        """Return the signals of the targets' cases."""
        states = [self.signal(damage) for damage in ({}, *SHIFTED, LOST)]
        return targets_of([signal for signal, _ in states], min(least for _, least in states))


def targets_of(signals: Sequence[FloatArray], least: float) -> PaperSignals:
    """Return the targets' cases: healthy, both shifts and the loss. The cases that are held out are not there."""
    healthy, *shifted, lost = signals
    unknown = np.full_like(healthy, np.nan)
    return PaperSignals(
        teeth=TEETH,
        healthy=healthy,
        shifts=dict(zip(TARGET_SHIFTS, shifted, strict=True)),
        elsewhere=unknown,
        losses={TARGET_LOSS: lost},
        pitted=unknown,
        broken=unknown,
        min_compression=least,
    )


def exact_targets(rig: Transmission) -> PaperSignals:
    """Return the signals of the targets' cases as `sigdb.simulate` makes them."""
    prepared = prepare_periodic(rig, gear=GEAR)
    prepared.floquet_multiplier([{}])
    prepared.floquet_multiplier([LOST])
    states = [prepared.steady_state([damage], specimens=False)[0] for damage in ({}, *SHIFTED, LOST)]
    return targets_of([state.signals[0] for state in states], min(float(s.min_compression) for s in states))
