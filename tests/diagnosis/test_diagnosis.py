"""Diagnosis of averages that were simulated apart from the templates and sent through a unknown path."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

import sigdb
from sigdb.core import InputError, Note
from sigdb.diagnosis.bank import rig_bank
from sigdb.diagnosis.diagnosis import diagnose_signature
from sigdb.diagnosis.notes import missing_notes, reading_notes
from sigdb.diagnosis.transfer_path import transfer_path
from sigdb.recording import SPEED_DOUBT, MeshPresence, RecordedSignature, in_unit

SENSOR, N, TEETH, REVOLUTIONS = "pinion-vertical", 768, 12, 102
ORDERS = np.arange(N // 2 + 1)
PRESENT = MeshPresence(present=True, reason="the mesh stands out", p_value=1e-9)
PATH = 50.0 / (1 - (ORDERS / 60) ** 2 + 0.1j * ORDERS / 60) * np.exp(-2j * np.pi * ORDERS * 0.01)
"""A resonance at order 60 with 5 % of critical damping, a gain of 50 V s/m, a delay of 1/100 of a revolution."""


@pytest.fixture(scope="module")
def rig():
    return sigdb.load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def bank(rig):
    return rig_bank(
        rig,
        gear="pinion",
        sensor=SENSOR,
        speed_rpm=rig.operating.speed_rpm,
        torque=rig.operating.torque,
        samples_per_tooth=64,
        index_error=2e-6,
    )


@pytest.fixture(scope="module")
def clean(rig):
    """Averages by damage, each simulated at its own tooth."""
    damages = {
        "none": None,
        "tooth 6": sigdb.Damage(tooth=6, stiffness_loss=0.4),
        "tooth 9": sigdb.Damage(tooth=9, stiffness_loss=0.2, phase_shift_deg=1.5, damaged_teeth=2),
    }
    return {name: sigdb.simulate(rig, damage).signal(SENSOR) for name, damage in damages.items()}


@pytest.fixture
def gears():
    """What these gears' errors add, the same to all recordings: 1 % of the signal at random orders."""
    stream = np.random.default_rng(7)
    spectrum = stream.standard_normal((2, N // 2 + 1)) * (ORDERS < 60)
    return 0.02 * np.fft.irfft(spectrum[0] + 1j * spectrum[1], N) * np.sqrt(N)


def recorded(signal, seed, *, gain=1.0, absolute=True, turn=0):
    """The signature of a recording of a signal, behind the path, with noise of 5 % of it in the average."""
    x = np.roll(gain * np.fft.irfft(PATH * np.fft.rfft(signal), N), turn * N // TEETH)
    noise = 0.05 * x.std()
    return RecordedSignature(
        intervals=pd.DataFrame({"indicator": [], "low": [], "high": []}),
        envelope=None,
        order_map=None,
        source="made here",
        channel="a1",
        unit="V",
        gear="pinion",
        shaft="pinion-shaft",
        teeth=TEETH,
        angle="tacho",
        absolute=absolute,
        tsa=x + noise * np.random.default_rng(seed).standard_normal(N),
        scatter=noise * np.sqrt(REVOLUTIONS),
        noise=np.full(N // 2 + 1, noise),
        averages=REVOLUTIONS,
        dropped=0,
        cycle=3,
        speed_rpm=14400.0,
        speed_track=pd.DataFrame(),
        kept=1.0,
        presence=PRESENT,
        highest_order=384.0,
        order_spectrum=pd.DataFrame(),
        record_spectrum=pd.DataFrame(),
        lines=pd.DataFrame(),
        indicators={},
        notes=(),
    )


@pytest.fixture
def diagnosed(rig, bank):
    def call(signature, healthy=None):
        operating = {"speed_rpm": rig.operating.speed_rpm, "torque": rig.operating.torque}
        return diagnose_signature(signature, bank, **operating, healthy=healthy)

    return call


def test_healthy_gears_are_called_healthy_whatever_their_errors(clean, gears, diagnosed):
    found = diagnosed(recorded(clean["none"] + gears, 1), recorded(clean["none"] + gears, 2))
    assert (found.kind, found.answer, found.severity) == ("none", "No tooth damage found.", None)
    assert found.p_damage < 0.1
    assert not found.missing


@pytest.mark.parametrize(("case", "tooth", "severity"), [("tooth 6", 6, (0.4, 0.0, 1)), ("tooth 9", 9, (0.2, 1.5, 2))])
def test_damage_is_found_behind_an_unknown_path(clean, gears, diagnosed, case, tooth, severity):
    found = diagnosed(recorded(clean[case] + gears, 1), recorded(clean["none"] + gears, 2))
    assert (found.kind, found.answer) == ("tooth", f"Damage at tooth {tooth}.")
    for true, (low, high) in zip(severity, found.severity[["low", "high"]].to_numpy(), strict=True):
        assert low <= true <= high


def test_without_a_tacho_mark_the_tooth_is_relative_to_the_recording(clean, gears, diagnosed):
    """Both averages begin at teeth of their own: the answer counts from where the damaged one begins."""
    damaged = recorded(clean["tooth 6"] + gears, 1, absolute=False, turn=5)
    found = diagnosed(damaged, recorded(clean["none"] + gears, 2, absolute=False, turn=3))
    assert found.answer.startswith("Damage at tooth 11, counted from where the average begins")
    assert [note.code for note in found.missing] == ["no-tacho-mark"]


def test_marks_that_do_not_agree_make_the_tooth_relative(clean, gears, diagnosed):
    """An inverted tacho turns the run's average by three teeth: tooth 6 is the ninth, and no number is absolute."""
    damaged = recorded(clean["tooth 6"] + gears, 1, turn=3)
    found = diagnosed(damaged, recorded(clean["none"] + gears, 2))
    assert found.answer == (
        "Damage at tooth 9, counted from where the average begins, since the tacho marks of the two recordings do not "
        "agree."
    )
    assert not found.as_json()["absolute"]
    assert found.notes[0].code == "marks-disagree"
    assert found.notes[0].values["teeth"] == pytest.approx(3, abs=0.1)
    assert not found.missing


@pytest.mark.parametrize("part", [0.45, 0.7])
def test_where_in_a_tooth_an_average_begins_does_not_matter(clean, gears, diagnosed, part):
    """Without a mark both begin at the same part of any tooth: it is a delay, not a path."""
    shift = np.exp(-2j * np.pi * ORDERS * part / TEETH)
    begun = {name: np.fft.irfft(shift * np.fft.rfft(x + gears), N) for name, x in clean.items()}
    found = diagnosed(recorded(begun["tooth 6"], 1, absolute=False), recorded(begun["none"], 2, absolute=False, turn=3))
    assert found.kind == "tooth"
    assert found.comparison.candidates in {(6,), (7,)}
    assert found.comparison.reduced_chi2 < found.comparison.limit


def test_coloured_noise_does_not_pass_for_damage(clean, gears, diagnosed):
    """Ten times as much noise at low orders as at high ones, stated so."""
    colour = np.where(ORDERS < 18, 3.0, 0.3)

    def coloured(seed):
        one = recorded(clean["none"] + gears, seed)
        noise = 0.05 * np.std(one.tsa) * colour
        stream = np.random.default_rng(seed + 10).standard_normal(N)
        return replace(
            one, tsa=one.tsa + np.fft.irfft(noise * np.fft.rfft(stream), N), noise=np.hypot(one.noise, noise)
        )

    found = diagnosed(coloured(1), coloured(2))
    assert found.kind in {"none", "not sure"}
    assert 0 in found.comparison.candidates


def test_a_recording_without_noise_is_limited_by_the_templates(clean, gears, diagnosed):
    """A path that the harmonics do not tell exactly, and damage between the simulated severities."""
    damaged = (clean["tooth 6"] + clean["none"]) / 2
    quiet = [replace(recorded(x + gears, 1), noise=np.full(N // 2 + 1, 1e-6)) for x in (damaged, clean["none"])]
    clear = [
        replace(one, tsa=np.fft.irfft(PATH * np.fft.rfft(x + gears), N))
        for one, x in zip(quiet, (damaged, clean["none"]), strict=True)
    ]
    found = diagnosed(*clear)
    assert (found.kind, found.answer) == ("tooth", "Damage at tooth 6.")
    low, high = found.severity.set_index("target").loc["stiffness_loss", ["low", "high"]]
    assert low <= 0.2 <= high


def notes_of(revolutions, *others, doubt="300 rpm explains the spectrum nearly as well"):
    average = Note(code="whole-revolutions", text=f"{revolutions} averaged", values={"revolutions": revolutions})
    return average, *others, Note(code=SPEED_DOUBT, text=doubt, values={"other_rpm": 300.0})


GAPS = Note(code="filled-gaps", text="2 samples were missing", values={"channel": "a1", "samples": 2})


def test_a_doubtful_speed_is_missing_and_notes_of_the_healthy_recording_are_those_that_it_adds(clean, gears, diagnosed):
    one = replace(recorded(clean["none"] + gears, 1), notes=notes_of(60))
    other = replace(recorded(clean["none"] + gears, 2), notes=notes_of(61, GAPS))
    found = diagnosed(one, other)
    assert [note.text for note in found.missing] == [
        "A reliable speed: 300 rpm explains the spectrum nearly as well.",
        "A reliable speed in the healthy recording: 300 rpm explains the spectrum nearly as well.",
    ]
    assert [note.text for note in found.reading] == ["60 averaged", "healthy recording: 2 samples were missing"]


def test_a_changed_sentence_changes_no_decision(clean):
    """The same notes in other words: the same ones are missing, and the same ones are left out."""
    notes = {1: notes_of(60, GAPS), 2: notes_of(61, replace(GAPS, text="other words 3", values={"channel": "a2"}))}

    def codes(rewrite):
        one, other = (
            replace(
                recorded(clean["none"], seed),
                notes=tuple(replace(note, text=rewrite(i, note.text)) for i, note in enumerate(notes[seed])),
            )
            for seed in (1, 2)
        )
        return [[note.code for note in part(one, other)] for part in (partial(missing_notes, mark=True), reading_notes)]

    missing, reading = codes(lambda i, text: text)
    assert missing == [SPEED_DOUBT] * 2
    assert reading == ["whole-revolutions", "filled-gaps", "filled-gaps"]
    assert codes(lambda i, text: f"{'uvw'[i]}: quite another sentence") == [missing, reading]
    assert codes(lambda i, text: "the speed is not certain") == [missing, reading]


def test_an_average_of_one_revolution_cannot_be_compared(clean, diagnosed):
    with pytest.raises(InputError, match="made here: an average of 1 revolutions without any noise cannot be compared"):
        diagnosed(replace(recorded(clean["none"], 1), noise=np.full(N // 2 + 1, np.nan), averages=1))


def test_a_changed_gain_is_told_and_does_not_pass_for_damage(clean, gears, diagnosed):
    healthy = recorded(clean["none"] + gears, 2)
    louder = diagnosed(recorded(clean["none"] + gears, 1, gain=2.0), healthy)
    assert louder.kind == "none"
    assert louder.comparison.reference.change_db[0] == pytest.approx(20 * np.log10(2), abs=0.1)
    assert "the mesh harmonics have changed by" in louder.notes[-1].text


def test_what_is_no_tooth_damage_is_outside_the_database(clean, gears, diagnosed):
    """A modulation once a revolution, as of an eccentric gear that was not there before."""
    angle = 2 * np.pi * np.arange(N) / N
    eccentric = clean["none"] * (1 + 0.5 * np.cos(angle))
    found = diagnosed(recorded(eccentric + gears, 1), recorded(clean["none"] + gears, 2))
    assert found.kind == "outside"
    assert found.severity is None


def test_without_a_healthy_recording_the_answer_says_what_is_missing(clean, diagnosed):
    found = diagnosed(recorded(clean["tooth 6"], 1))
    assert found.kind == "outside"
    assert [note.code for note in found.missing] == ["no-healthy-recording"]
    assert found.as_json()["path"] is None


def test_the_path_is_that_of_the_structure_between_mesh_harmonics():
    """Of a path of constant gain and delay every interpolated gain is exact."""
    stream = np.random.default_rng(0)
    simulated = np.fft.irfft(np.where(ORDERS % TEETH == 0, stream.standard_normal(len(ORDERS)) + 2j, 0), N)
    true = 3.0 * np.exp(-2j * np.pi * ORDERS * 0.3 / TEETH)
    path = transfer_path(np.fft.irfft(true * np.fft.rfft(simulated), N), simulated, teeth=TEETH, noise=1e-9)
    np.testing.assert_allclose(path.gain[path.covered], true[path.covered], rtol=1e-9)
    assert path.harmonics.tolist() == list(range(1, 32))


def test_a_recording_without_mesh_harmonics_tells_no_path(clean):
    stream = np.random.default_rng(0)
    with pytest.raises(InputError, match="no mesh harmonic of 12 teeth stands above the noise"):
        transfer_path(stream.standard_normal(N), clean["none"], teeth=TEETH, noise=1.0)


def test_units_are_brought_to_the_sensors(clean):
    signature = replace(recorded(clean["none"], 1), unit="g")
    np.testing.assert_allclose(in_unit(signature, "m/s^2").tsa, 9.80665 * signature.tsa)
    with pytest.raises(InputError, match=r"a1 is in 'V', the simulated sensor in 'm/s'"):
        in_unit(replace(signature, unit="V"), "m/s")
    unstated = in_unit(replace(signature, unit=""), "m/s")
    assert unstated.notes[-1].text == "The unit of a1 is not stated; it was taken to be m/s."


def test_a_speed_at_which_the_healthy_gears_part_asks_for_the_sampling_rate(rig, monkeypatch):
    """At 0.7 times its speed the mesh of this rig feeds a resonance."""
    for name, values in (("DAMAGED_TEETH", (1,)), ("SHIFTS_DEG", (0.0,)), ("LOSSES", (0.1,))):
        monkeypatch.setattr(f"sigdb.diagnosis.bank.{name}", values)
    options = {"gear": "pinion", "sensor": SENSOR, "torque": 356.0, "samples_per_tooth": 32, "index_error": 2e-6}
    says = r"no templates at 10080 rpm and 356 N m, .* its operating point is 14400 rpm and .*: check the sampling"
    with pytest.raises(InputError, match=says):
        rig_bank(rig, speed_rpm=0.7 * rig.operating.speed_rpm, **options)
