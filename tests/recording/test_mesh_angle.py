"""Verification: a mesh phase that locks onto a sideband, onto noise or onto an end of its range is refused or noted."""

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.recording import SPEED_DOUBT, Channel, Recording, recorded_signature

FS, TEETH, SECONDS = 6400.0, 24, 6.0
T = np.arange(int(FS * SECONDS)) / FS


def gear(rpm=1500.0, noise=0.5, depth=0.3, other=0.0):
    """A gear of 24 teeth with sidebands; its speed wanders by 0.2 %. Another mesh of 19.2 orders."""
    stream = np.random.default_rng(0)
    turns = np.cumsum(rpm / 60 * (1 + 0.002 * np.interp(T, np.linspace(0, SECONDS, 30), stream.normal(size=30)))) / FS
    theta = 2 * np.pi * turns
    mesh = np.cos(24 * theta) + 0.6 * np.cos(48 * theta + 0.4) + 0.4 * np.cos(72 * theta + 1)
    x = (1 + depth * np.cos(theta - 1) + depth / 2 * np.cos(2 * theta)) * mesh
    x += other * (np.cos(19.2 * theta) + 0.5 * np.cos(38.4 * theta)) * (1 + 0.3 * np.cos(0.4 * theta))
    x += noise * stream.normal(size=T.size)
    return Recording(source="made", channels=(Channel(name="a1", samples=x, sampling_rate=FS, unit="g"),))


@pytest.mark.parametrize(
    ("stated", "depth", "noise"), [(1400.0, 0.05, 0.3), (1600.0, 0.8, 2.0), (1300.0, 0.05, 2.0), (750.0, 0.8, 0.3)]
)
def test_a_sideband_is_not_taken_for_the_mesh(stated, depth, noise):
    low, high = round(0.95 * stated, 1), round(1.05 * stated, 1)
    with pytest.raises(
        InputError, match=rf"no speed is found from {low:g} to {high:g} rpm: .* give the right speed"
    ) as error:
        recorded_signature(gear(depth=depth, noise=noise), teeth=TEETH, mesh_phase=True, speed_rpm=stated)
    beyond = float(str(error.value).partition("stands out less than ")[2].partition(" rpm")[0])
    assert beyond == pytest.approx(1500, rel=0.01)


@pytest.mark.parametrize("stated", [1500.0, 1440.0, 1560.0])
@pytest.mark.parametrize("other", [0.0, 5.0])
def test_the_right_speed_is_found_beside_a_louder_mesh(stated, other):
    found = recorded_signature(gear(other=other), teeth=TEETH, mesh_phase=True, speed_rpm=stated)
    assert found.speed_rpm == pytest.approx(1500, rel=2e-3)
    assert SPEED_DOUBT not in {note.code for note in found.notes}
    assert found.kept > 0.2 if other else found.kept > 0.8


def test_another_gear_that_stands_out_more_is_noted():
    both = gear().channels[0].samples + 3 * gear(1170.0, noise=0.0).channels[0].samples
    recording = Recording(source="made", channels=(Channel(name="a1", samples=both, sampling_rate=FS),))
    found = recorded_signature(recording, teeth=TEETH, mesh_phase=True, speed_rpm=1500.0)
    assert found.speed_rpm == pytest.approx(1500, rel=5e-3)
    note = {note.code: note for note in found.notes}[SPEED_DOUBT]
    assert note.values["other_rpm"] == pytest.approx(1170, rel=5e-3)
    assert "beyond the range" in note.text


def test_a_harmonic_whose_phase_slips_is_not_taken():
    """The third harmonic is the strongest, but is away for half a second, in which its phase slips by one cycle."""
    turns = 25.0 * T
    away = np.clip(np.abs(T - SECONDS / 2) / 0.4, 0, 1)
    third = away * np.cos(2 * np.pi * (3 * TEETH * turns + np.clip((T - SECONDS / 2) / 0.5 + 0.5, 0, 1)))
    mesh = (1 + 0.3 * np.cos(2 * np.pi * turns)) * np.cos(2 * np.pi * TEETH * turns)
    x = 0.5 * mesh + third + 0.2 * np.random.default_rng(0).normal(size=T.size)
    recording = Recording(source="made", channels=(Channel(name="a1", samples=x, sampling_rate=FS),))
    found = recorded_signature(recording, teeth=TEETH, mesh_phase=True, speed_rpm=1500.0)
    assert found.angle == "phase of mesh harmonic 1 of a1"
    assert found.presence.present


def test_a_speed_at_an_end_of_its_range_is_refused():
    with pytest.raises(InputError, match=r"no speed is found from 1510 to 1600 rpm: "):
        recorded_signature(gear(), teeth=TEETH, mesh_phase=True, speed_range_rpm=(1510.0, 1600.0))


def test_a_mesh_above_half_the_rate_is_refused():
    with pytest.raises(InputError, match="must begin below fs/2 = 3200 Hz; check its unit and the sampling rate"):
        recorded_signature(gear(), teeth=24, mesh_phase=True, speed_rpm=9000.0)
