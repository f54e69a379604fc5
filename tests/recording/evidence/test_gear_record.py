"""Unit: the speed at which a gear is present is found where the phase followed a sideband."""

import numpy as np
import pytest

from sigdb.recording import Channel, Recording
from sigdb.recording.evidence.gear_record import at_true_speed, gear_record, sideband_speeds
from sigdb.recording.orders import averaged_gear
from sigdb.recording.shaft_angle import ShaftAngle

FS, TEETH, SPEED = 6400.0, 19, 30.0
SETTINGS = {"samples_per_tooth": 16, "revolutions": None}


def record(apparent):
    """The record of a gear at 30 rev/s by an angle that turns at another speed."""
    t = np.arange(int(4 * FS)) / FS
    theta = 2 * np.pi * SPEED * t
    mesh = np.cos(TEETH * theta) + 0.6 * np.cos(2 * TEETH * theta + 1) + 0.4 * np.cos(3 * TEETH * theta + 2)
    x = (1 + 0.4 * np.cos(theta)) * mesh + 0.1 * np.random.default_rng(0).standard_normal(t.size)
    angle = ShaftAngle(
        pulses=np.arange(0.05, 3.9, 1 / (TEETH * apparent)),
        pulses_per_rev=TEETH,
        ratio=1.0,
        absolute=False,
        source="phase of mesh harmonic 1 of a1",
    )
    gear = averaged_gear(TEETH)
    signal = Channel(name="a1", samples=x, sampling_rate=FS)
    recording = Recording(source="run.csv", channels=(signal,))
    return recording, gear_record(recording, signal, angle, gear, mesh_phase=True, **SETTINGS), gear


def test_speeds_are_those_of_sidebands_that_passed_for_the_mesh():
    """Sidebands 18 and 20 of 19, and those of harmonics two and three."""
    apparent = {18 / 19, 20 / 19, 37 / 38, 39 / 38, 56 / 57, 58 / 57, 55 / 57, 59 / 57}
    assert sorted(sideband_speeds(TEETH)) == pytest.approx(sorted(1 / speed for speed in apparent))


@pytest.mark.parametrize("order", [18, 20, 19.5])
def test_a_sideband_that_passed_for_the_mesh_is_put_right(order):
    recording, wrong, gear = record(SPEED * order / TEETH)
    assert not wrong.presence.present
    right = at_true_speed(recording, wrong, gear, range_rpm=(1600.0, 2000.0), **SETTINGS)
    assert right.presence.present
    assert right.speed_rpm == pytest.approx(60 * SPEED, rel=1e-4)
    note = right.angle.notes[-1]
    assert note.code == "speed-by-repetition"
    assert note.values["apparent_rpm"] == pytest.approx(60 * SPEED * order / TEETH, rel=1e-3)


def test_a_speed_beyond_the_range_is_not_taken():
    recording, wrong, gear = record(SPEED * 18 / TEETH)
    assert at_true_speed(recording, wrong, gear, range_rpm=(1500.0, 1750.0), **SETTINGS) is wrong
