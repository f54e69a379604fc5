"""Verification: damage of the pinion and of the wheel of a pair, by recordings that no simulation of sigdb made."""

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.diagnosis import diagnose
from sigdb.diagnosis.diagnose_signature import diagnose_signature
from sigdb.diagnosis.mate import Mate, diagnosis_of_pair
from sigdb.recording import AveragingSettings, Channel, Recording, recorded_signature

PINION, WHEEL, RATE = 24, 45, 12_800.0
RIG = sigdb.new_rig(teeth=f"{PINION}/{WHEEL}", speed="1680rpm", torque="50Nm")
TEETH = {"pinion": PINION, "wheel": WHEEL}


def recorded(seed, *, gear=None, tooth=1, size=0.5, mark=True):
    """A mesh with errors of both gears, noise, and an event in each turn of a gear, 1.1 passes after its contact."""
    t = np.arange(int(8 * RATE)) / RATE
    passes = PINION * (0.3 + 0.07 * seed + 28.0 * t + 0.02 * np.sin(t))
    errors = {name: np.random.default_rng(Z).standard_normal(Z) for name, Z in TEETH.items()}
    trace = sum(error[passes.astype(int) % len(error)] for error in errors.values())
    x = sum((1 + 0.1 * trace) * np.cos(2 * np.pi * h * passes + h) / h for h in (1, 2, 3, 4))
    if gear is not None:
        Z = TEETH[gear]
        after = (passes - (tooth - 1) - 1.1 + Z / 2) % Z - Z / 2
        x = x + size * np.exp(-3 * after**2) * np.cos(3 * np.pi * after)
    x = x + 0.5 * np.random.default_rng(seed).standard_normal(t.size)
    channels = [Channel(name="a1", samples=x, sampling_rate=RATE, unit="m/s^2")]
    if mark:
        channels.append(Channel(name="tacho", samples=1.0 * (passes / PINION % 1 < 0.1), sampling_rate=RATE))
    return Recording(source="made here", channels=tuple(channels), tacho="tacho" if mark else None)


def paired(run, healthy, **options):
    """The diagnosis of the pair by pulses alone."""
    settings = AveragingSettings(channel="a1", gear="pinion", **options)
    signatures = [recorded_signature(each, settings, rig=RIG) for each in (run, healthy)]
    mate = Mate.of([run, healthy], signatures, RIG, settings, torque=None, healthy_torques=[None])
    return diagnosis_of_pair(diagnose_signature(signatures[0], signatures[1:]), mate)


@pytest.mark.parametrize(
    ("gear", "tooth", "mark"), [("pinion", 7, True), ("pinion", 7, False), ("wheel", 31, True), ("wheel", 31, False)]
)
def test_the_gear_that_is_damaged_is_named(gear, tooth, mark):
    options = {} if mark else {"mesh_phase": True, "speed_rpm": 1680.0}
    found = paired(recorded(1, gear=gear, tooth=tooth, mark=mark), recorded(2, mark=mark), **options)
    notes = {note.code: note for note in found.notes}
    assert "other-shaft" not in notes
    assert (found.kind, found.signature.gear) == ("one tooth", gear)
    assert found.as_json()["gear"] == gear
    note = notes["this-gear" if gear == "pinion" else "other-gear"]
    assert (note.values["gear_pulse"] > note.values["mate_pulse"]) == (gear == "pinion")
    assert (" of wheel" in found.answer) == (gear == "wheel")
    if mark and gear == "pinion":
        assert tooth in found.candidates


def test_no_tooth_of_either_gear_is_an_answer_with_what_would_have_been_seen_of_both():
    found = paired(recorded(1), recorded(2))
    note = {note.code: note for note in found.notes}["mate-unchanged"]
    assert found.exit_code == 0
    assert note.values["smallest_pulse"] < 0.5
    assert note.text.startswith("No tooth of wheel stands out either, by pulses alone; an event of ")


def test_gears_that_turn_equally_fast_are_not_told_apart():
    rig = sigdb.new_rig(teeth="24/24", speed="1680rpm", torque="50Nm")
    settings = AveragingSettings(channel="a1", gear="pinion")
    signature = recorded_signature(recorded(2), settings, rig=rig)
    with pytest.raises(InputError, match="pinion and wheel turn equally fast"):
        Mate.of([recorded(2)], [signature], rig, settings, torque=None, healthy_torques=[])


def test_a_reference_of_one_gear_leaves_the_mate_open(tmp_path):
    """The diagnosis of the files themselves names the wheel; with the stored averages a note says what is not known."""
    run, healthy, file = recorded(1, gear="wheel", tooth=31), recorded(2), tmp_path / "machine.npz"
    facts = {"teeth": f"{PINION}/{WHEEL}", "channel": "a1"}
    assert diagnose(run, healthy=healthy, save_reference=file, **facts).signature.gear == "wheel"
    found = diagnose(run, healthy=file, **facts)
    text = {note.code: note.text for note in found.notes}["mate-not-compared"]
    assert "averages of a reference or a database are those of one gear" in text
