"""Validation: published boundaries of contact loss and of parametric instability, by the march on one oscillator.

Published numbers: the linear branch of the dead-zone oscillator (dead zone +/-1, 5 % damping, mean force
0.1), Mathieu's characteristic values (NIST Digital Library of Mathematical Functions, chapter 28), Meissner's closed
form and Hill's determinant; r is the frequency of the excitation over the natural one.
"""

import numpy as np
import pytest

ZETA, MEAN_FORCE, STEPS = 0.05, 0.1, 1024
PHASE = 2 * np.pi * np.arange(4097) / 4096


@pytest.mark.parametrize(
    ("amplitude", "first", "last"),
    [(lambda r: 0.05 * r**2, 0.820631, 1.407088), (lambda r: 0.05, 0.710686, 1.218574)],
    ids=["internal", "constant"],
)
@pytest.mark.parametrize(("off", "beyond"), [(-1e-4, False), (1e-4, True)])
def test_the_linear_branch_loses_contact_between_the_published_speeds(oscillator, amplitude, first, last, off, beyond):
    """Marched for 30 periods from the linear steady state; without loss it stays there to the error of the step."""
    for r in (first + off, last - off):
        step, steps = 2 * np.pi / r / STEPS, 30 * STEPS
        rotor = np.exp(1j * r * step * np.arange(steps + 1))
        phasor = amplitude(r) / (1 - r**2 + 2j * ZETA * r)
        march = oscillator(np.ones(2), step, zeta=ZETA, force=MEAN_FORCE, backlash=2.0)
        forces = amplitude(r) * rotor.real
        x, _, mesh_force = march(phasor.real, (1j * r * phasor).real, steps, forces=forces)
        assert (abs(phasor) > MEAN_FORCE) is beyond
        assert bool((mesh_force == 0).any()) is beyond
        assert bool((x < 0).any()) is beyond
        off_the_branch = np.abs(x - MEAN_FORCE - (phasor * rotor).real).max()
        # (w h)^2 / 12 of the force between two steps, at resonance some 1 / (2 zeta) times.
        assert beyond or off_the_branch < 1e-6


def peaks(oscillator, stiffness, period, periods, *, steps=512, **more):
    """Greatest deflection in each period. Without backlash a mesh is a spring that also pulls."""
    march = oscillator(stiffness, period / steps, backlash=1e-9, **more)
    x, _, _ = march(1.0, 0.3, steps * periods, turns=np.arange(steps * periods + 1) / steps)
    return np.abs(x[1:]).reshape(periods, steps).max(axis=1)


def grows(peak):
    """Whether the last quarter is well above the second: e-fold; what stays bounded only beats."""
    second, last = (peak[len(peak) * i // 4 : len(peak) * (i + 1) // 4].max() for i in (1, 3))
    return bool(last > np.e * second)


@pytest.mark.parametrize(("a", "unstable"), [(0.4700, False), (0.4713, True), (1.4660, True), (1.4675, False)])
def test_mathieu_grows_between_b1_and_a1(oscillator, a, unstable):
    """x'' + (a - 2 q cos 2t) x = 0 at q = 0.5: b1 0.470654, a1 1.466767; the mesh varies about 2 beside a spring."""
    assert grows(peaks(oscillator, 2 - np.cos(PHASE), np.pi, 400, mean=2.0, total=a)) is unstable


@pytest.mark.parametrize(("r", "unstable"), [(1.8045, False), (1.8070, True), (2.1850, True), (2.1875, False)])
def test_the_square_wave_grows_between_meissners_boundaries(oscillator, r, unstable):
    """+/-0.3 undamped: 1.805814 < r < 2.186257."""
    wave = np.where(np.arange(4097) % 4096 < 2048, 1.3, 0.7)
    assert grows(peaks(oscillator, wave, 2 * np.pi / r, 400)) is unstable


@pytest.mark.parametrize(("r", "unstable"), [(1.8825, False), (1.8838, True), (2.1057, True), (2.1071, False)])
def test_the_damped_tongue_grows_between_the_published_boundaries(oscillator, r, unstable):
    """1 + 0.3 cos(r t) with 5 % damping: 1.883144 < r < 2.106392; with damping what does not grow decays."""
    peak = peaks(oscillator, 1 + 0.3 * np.cos(PHASE), 2 * np.pi / r, 1600, steps=256, zeta=ZETA)
    assert bool(peak[-1] > peak[400]) is unstable
