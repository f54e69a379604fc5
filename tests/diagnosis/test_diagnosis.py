"""Diagnosis of averages that were simulated apart from the templates and sent through an unknown path."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

import sigdb
from sigdb.core import InputError, Note
from sigdb.diagnosis import Detector
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum
from sigdb.diagnosis.change.change import turn_between
from sigdb.diagnosis.change.path import path_gain
from sigdb.diagnosis.change.templates import Templates
from sigdb.diagnosis.diagnose_signature import diagnose_signature
from sigdb.diagnosis.notes import method_notes, missing_notes, reading_notes
from sigdb.recording import SPEED_DOUBT, MeshPresence, RecordedSignature

SENSOR, N, TEETH, REVOLUTIONS, GROUPS = "pinion-vertical", 768, 12, 102, 12
ORDERS = np.arange(N // 2 + 1)
PRESENT = MeshPresence(present=True, reason="the mesh stands out", p_value=1e-9)
PATH = 50.0 / (1 - (ORDERS / 60) ** 2 + 0.1j * ORDERS / 60) * np.exp(-2j * np.pi * ORDERS * 0.01)
"""A resonance at order 60 with 5 % of critical damping, a gain of 50 V s/m, a delay of 1/100 of a revolution."""


@pytest.fixture(scope="module")
def rig():
    return sigdb.load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def templates(rig):
    return Templates.simulated([rig], gear="pinion", sensor=SENSOR, samples_per_tooth=64, described=True)


@pytest.fixture(scope="module")
def clean(rig):
    """Averages by damage, each simulated at its own tooth."""
    damages = {
        "none": None,
        "tooth 6": sigdb.Damage(tooth=6, stiffness_loss=0.4),
        "tooth 9": sigdb.Damage(tooth=9, stiffness_loss=0.3, damaged_teeth=2),
    }
    return {name: sigdb.simulate(rig, damage).signal(SENSOR) for name, damage in damages.items()}


@pytest.fixture
def gears():
    """What these gears' errors add, the same to all recordings: 1 % of the signal at random orders."""
    stream = np.random.default_rng(7)
    spectrum = stream.standard_normal((2, N // 2 + 1)) * (ORDERS < 60)
    return 0.02 * np.fft.irfft(spectrum[0] + 1j * spectrum[1], N) * np.sqrt(N)


def recorded(signal, seed, *, gain=1.0, absolute=True, turn=0, noise=0.05, groups=GROUPS, **names):
    """The signature of a recording of a signal, behind the path, with noise of 5 % of it in the average."""
    x = np.roll(gain * np.fft.irfft(PATH * np.fft.rfft(signal), N), turn * N // TEETH)
    deviation = noise * x.std()
    each = x + deviation * np.sqrt(groups) * np.random.default_rng(seed).standard_normal((groups, N))
    facts = {
        "intervals": pd.DataFrame({"indicator": [], "low": [], "high": []}),
        "envelope": None,
        "shafts": pd.DataFrame(),
        "order_map": None,
        "source": "made here",
        "channel": "a1",
        "unit": "V",
        "gear": "pinion",
        "shaft": "pinion-shaft",
        "teeth": TEETH,
        "angle": "tacho",
        "absolute": absolute,
        "tsa": each.mean(axis=0),
        "scatter": deviation * np.sqrt(REVOLUTIONS),
        "noise": np.full(N // 2 + 1, deviation),
        "groups": each,
        "averages": REVOLUTIONS,
        "dropped": 0,
        "cycle": 3,
        "speed_rpm": 14400.0,
        "speed_track": pd.DataFrame(),
        "kept": 1.0,
        "presence": PRESENT,
        "highest_order": 384.0,
        "order_spectrum": pd.DataFrame(),
        "record_spectrum": pd.DataFrame(),
        "lines": pd.DataFrame(),
        "indicators": {},
        "notes": (),
    }
    return RecordedSignature(**facts | names)


@pytest.fixture
def diagnosed(templates):
    def call(signature, *healthy, **options):
        return diagnose_signature(signature, healthy, templates=templates, **options)

    return call


def test_healthy_gears_do_not_change_whatever_their_errors(clean, gears, diagnosed):
    found = diagnosed(recorded(clean["none"] + gears, 1), recorded(clean["none"] + gears, 2))
    assert (found.kind, found.exit_code, found.severity, found.locations) == ("no change", 0, None, ())
    assert found.power.smallest <= 0.4
    assert found.answer.startswith("No change; a stiffness loss of ")
    assert found.law.pieces == GROUPS
    assert found.as_json()["false_alarms"] == {"rate": pytest.approx(1 / (GROUPS + 1)), "pieces": GROUPS}
    assert not found.missing


@pytest.mark.parametrize(("case", "tooth", "loss", "count"), [("tooth 6", 6, 0.4, 1), ("tooth 9", 9, 0.3, 2)])
def test_damage_is_found_behind_an_unknown_path(clean, gears, diagnosed, case, tooth, loss, count):
    found = diagnosed(recorded(clean[case] + gears, 1), recorded(clean["none"] + gears, 2))
    assert (found.kind, found.exit_code) == ("one tooth", 1)
    assert tooth in found.candidates
    assert found.locations[0].within <= 1
    severity = found.severity.set_index("target")
    assert severity.loc["stiffness_loss", "low"] <= loss <= severity.loc["stiffness_loss", "high"]
    assert severity.loc["damaged_teeth", "low"] <= count <= severity.loc["damaged_teeth", "high"]


def test_every_detector_has_its_limit_and_its_rate_of_false_alarms(clean, gears, diagnosed):
    """FM4 and NA4 of Gaussian noise are 3, and the greatest of twelve pieces is not far above; damage is above all."""
    healthy = recorded(clean["none"] + gears, 2, noise=0.01)
    quiet, loud = (diagnosed(recorded(clean[case] + gears, 1, noise=0.01), healthy) for case in ("none", "tooth 6"))
    assert [each.name for each in quiet.detectors] == ["pulse", "FM4", "NA4", "template", "likelihood"]
    assert {(each.pieces, each.false_alarm_rate) for each in quiet.detectors} == {(GROUPS, 1 / (GROUPS + 1))}
    values = {each.name: each for each in quiet.detectors}
    for name in ("FM4", "NA4"):
        assert values[name].value == pytest.approx(3, abs=0.7)
        assert 3 < values[name].limit < 5
    assert all(each.alarm for each in loud.detectors)
    assert loud.detectors[2].value > 81 * loud.detectors[1].value  # the difference is three times as great or more
    row = loud.as_json()["detectors"][1]
    assert (row["name"], row["alarm"], row["simulated"], row["decides"]) == ("FM4", True, False, False)


@pytest.mark.parametrize(
    ("alarms", "codes"),
    [
        ({}, []),
        ({"pulse", "FM4", "NA4", "template"}, []),
        ({"pulse"}, ["methods-disagree", "fm4-disagrees", "na4-disagrees"]),
        ({"template", "FM4", "NA4"}, ["methods-disagree"]),
        ({"NA4"}, ["na4-disagrees"]),
    ],
)
def test_detectors_that_disagree_are_named(alarms, codes):
    names = ("pulse", "FM4", "NA4", "template")
    rows = [
        Detector(name=name, value=2.0 if name in alarms else 0.5, limit=1.0, pieces=24, false_alarm_rate=0.04)
        for name in names
    ]
    assert [note.code for note in method_notes(rows)] == codes
    assert [note.code for note in method_notes(rows[:1])] == []


def test_without_a_tacho_mark_the_tooth_is_relative_to_the_recording(clean, gears, diagnosed):
    """Both averages begin at teeth of their own: the answer counts from where the damaged one begins."""
    damaged = recorded(clean["tooth 6"] + gears, 1, absolute=False, turn=5)
    found = diagnosed(damaged, recorded(clean["none"] + gears, 2, absolute=False, turn=3))
    assert 11 in found.candidates
    assert found.answer.endswith(", counted from where the average begins, since there is no tacho mark.")
    assert [note.code for note in found.missing] == ["no-tacho-mark"]


def test_marks_that_do_not_agree_make_the_tooth_relative(clean, gears, diagnosed):
    """An inverted tacho turns the run's average by three teeth: tooth 6 is the ninth, and no number is absolute."""
    damaged = recorded(clean["tooth 6"] + gears, 1, turn=3)
    found = diagnosed(damaged, recorded(clean["none"] + gears, 2))
    assert found.answer.endswith("since the tacho marks of the two recordings do not agree.")
    assert 9 in found.candidates
    assert not found.as_json()["absolute"]
    assert found.notes[0].code == "marks-disagree"
    assert found.notes[0].values["teeth"] == pytest.approx(3, abs=0.1)
    assert not found.missing


@pytest.mark.parametrize("part", [0.0, 1 / 3, 0.45, 0.7])
def test_where_in_a_tooth_an_average_begins_does_not_matter(clean, gears, diagnosed, part):
    """Without a mark a mesh harmonic h leaves the beginning open by 1 / h of a pass, for each recording its own."""
    turn = np.exp(-2j * np.pi * ORDERS * part / TEETH)
    begun = np.fft.irfft(turn * np.fft.rfft(clean["tooth 6"] + gears), N)
    found = diagnosed(recorded(begun, 1, absolute=False), recorded(clean["none"] + gears, 2, absolute=False, turn=3))
    assert found.kind == "one tooth"
    assert {6, 7} & set(found.candidates)
    turned = (found.finding.change.turn * TEETH + 6) % 12 - 6
    assert turned == pytest.approx(3 - part, abs=0.3)  # what the teeth leave is as great as the noise


def test_averages_are_aligned_to_a_five_hundredth_of_a_tooth(clean, gears):
    turn = np.exp(-2j * np.pi * ORDERS * 0.3458 / TEETH)
    begun = np.fft.irfft(turn * np.fft.rfft(clean["none"] + 5 * gears), N)
    run = AverageSpectrum.of(recorded(begun, 1, noise=0.001, turn=7))
    healthy = AverageSpectrum.of(recorded(clean["none"] + 5 * gears, 2, noise=0.001))
    assert turn_between(run, healthy, absolute=False) * TEETH == pytest.approx(-7.3458 + 12, abs=1 / 500)
    near = np.exp(-2j * np.pi * ORDERS * 0.013 / TEETH)
    late = recorded(np.fft.irfft(near * np.fft.rfft(clean["none"] + 5 * gears), N), 1, noise=0.001)
    found = turn_between(AverageSpectrum.of(late), healthy, absolute=True)
    assert found * TEETH == pytest.approx(-0.013, abs=1 / 500)


def test_coloured_noise_does_not_pass_for_damage(clean, gears, diagnosed):
    """Ten times as much noise at low orders as at high ones, in each revolution."""
    colour = np.where(ORDERS < 18, 3.0, 0.3)

    def coloured(seed):
        one = recorded(clean["none"] + gears, seed, noise=1e-3)
        white = np.random.default_rng(seed + 10).standard_normal(one.groups.shape)
        noise = 0.05 * np.sqrt(GROUPS) * one.tsa.std() * np.fft.irfft(colour * np.fft.rfft(white), N)
        return replace(one, groups=one.groups + noise)

    assert diagnosed(coloured(1), coloured(2)).kind == "no change"


def test_a_recording_almost_without_noise_is_judged_by_what_the_model_explains(clean, gears, diagnosed):
    """Damage between the simulated severities, behind a path that its harmonics do not determine exactly."""
    damaged = (clean["tooth 6"] + clean["none"]) / 2
    found = diagnosed(recorded(damaged + gears, 1, noise=1e-5), recorded(clean["none"] + gears, 2, noise=1e-5))
    assert found.kind == "one tooth"
    assert 6 in found.candidates
    loss = found.severity.set_index("target").loc["stiffness_loss"]
    assert loss["low"] <= 0.2 <= loss["high"]


def notes_of(revolutions, *others, doubt="300 rpm explains the spectrum nearly as well"):
    average = Note(code="whole-revolutions", text=f"{revolutions} averaged", values={"revolutions": revolutions})
    return average, *others, Note(code=SPEED_DOUBT, text=doubt, values={"other_rpm": 300.0})


GAPS = Note(code="filled-gaps", text="2 samples were missing", values={"channel": "a1", "samples": 2})


def test_a_doubtful_speed_is_missing_and_notes_of_the_healthy_recording_are_those_that_it_adds(clean, gears, diagnosed):
    one = recorded(clean["none"] + gears, 1, notes=notes_of(60))
    other = recorded(clean["none"] + gears, 2, notes=notes_of(61, GAPS))
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
            recorded(
                clean["none"],
                seed,
                notes=tuple(replace(note, text=rewrite(i, note.text)) for i, note in enumerate(notes[seed])),
            )
            for seed in (1, 2)
        )
        parts = (partial(missing_notes, mark=True), reading_notes)
        return [[note.code for note in part(one, [other])] for part in parts]

    missing, reading = codes(lambda i, text: text)
    assert missing == [SPEED_DOUBT] * 2
    assert reading == ["whole-revolutions", "filled-gaps", "filled-gaps"]
    assert codes(lambda i, text: f"{'uvw'[i]}: quite another sentence") == [missing, reading]
    assert codes(lambda i, text: "the speed is not certain") == [missing, reading]


def test_an_average_of_few_revolutions_cannot_be_judged(clean, diagnosed):
    short = recorded(clean["none"], 1, groups=3, source="short.csv")
    found = diagnosed(short, recorded(clean["none"], 2))
    assert (found.kind, found.exit_code) == ("cannot be judged", 3)
    assert found.answer == "Cannot be judged: short.csv has 3 revolutions, fewer than 6."


@pytest.mark.parametrize(("gain", "cause"), [(2.0, "sensor gain"), (-1.0, "polarity")])
def test_a_changed_sensor_is_named_and_does_not_pass_for_damage(clean, gears, diagnosed, gain, cause):
    found = diagnosed(recorded(clean["none"] + gears, 1, gain=gain), recorded(clean["none"] + gears, 2))
    assert (found.kind, found.exit_code, found.level.cause) == ("level changed", 0, cause)
    assert found.level.mesh_db[0] == pytest.approx(20 * np.log10(abs(gain)), abs=0.2)
    assert "would have been seen at any tooth with probability 0.95" in found.answer


def test_a_modulation_of_all_teeth_is_no_tooth(clean, gears, diagnosed):
    """A modulation once a revolution, as of an eccentric gear that was not there before."""
    eccentric = clean["none"] * (1 + 0.5 * np.cos(2 * np.pi * np.arange(N) / N))
    found = diagnosed(recorded(eccentric + gears, 1), recorded(clean["none"] + gears, 2))
    assert found.kind not in ("one tooth", "several teeth")


def test_teeth_apart_are_several(rig, clean, gears, diagnosed):
    change = clean["tooth 6"] - clean["none"]
    both = clean["none"] + change + np.roll(change, 6 * N // TEETH)
    found = diagnosed(recorded(both + gears, 1, noise=0.01), recorded(clean["none"] + gears, 2, noise=0.01))
    assert found.kind in ("one tooth", "several teeth")
    assert {6, 12} & set(found.candidates)


def test_the_reference_is_interpolated_in_load(clean, gears, diagnosed):
    """What the errors of the teeth leave grows with the load: between two loads their mean has no change left."""
    fingerprint = 3 * gears
    at = {
        load: clean["none"] + fingerprint * (1 + np.roll(gears, 100) / gears.std() * (load - 50) / 100)
        for load in (30, 50, 70)
    }
    one = recorded(at[50], 1, noise=0.005)
    loads = [recorded(at[load], load, noise=0.005) for load in (30, 70)]
    apart = diagnosed(one, loads[0]).finding.change.misfit
    interpolated = diagnosed(one, *loads, torque=50.0, healthy_torques=[30.0, 70.0])
    between = interpolated.finding.change.misfit
    assert interpolated.level.cause != "load"
    assert apart > 2 * between
    outside = diagnosed(one, *loads, torque=90.0, healthy_torques=[30.0, 70.0])
    assert "torque-outside-healthy" in [note.code for note in outside.notes]


def test_the_path_is_that_of_the_structure_between_mesh_harmonics():
    """Every gain between is exact for a path of constant gain and delay, up to the record's highest order."""
    stream = np.random.default_rng(0)
    simulated = np.where(ORDERS % TEETH == 0, stream.standard_normal(len(ORDERS)) + 2j, 0)
    true = 3.0 * np.exp(-2j * np.pi * ORDERS * 0.3 / TEETH)
    measured = AverageSpectrum(
        source="made here",
        groups=np.tile(true * simulated, (6, 1)),
        spread=np.full(len(ORDERS), 1e-18),
        teeth=TEETH,
        samples=N,
        highest_order=200.0,
    )
    gain = path_gain(measured, simulated)
    held = (ORDERS >= TEETH) & (ORDERS <= 192)
    np.testing.assert_allclose(gain[held], true[held], rtol=1e-9)
    assert not gain[ORDERS >= 200].any()


def test_templates_of_another_length_are_refused(clean, templates):
    short = replace(templates, samples=384)
    with pytest.raises(InputError, match="averages of the templates have 384 samples, those of the recording 768"):
        diagnose_signature(recorded(clean["none"], 1), [recorded(clean["none"], 2)], templates=short)
