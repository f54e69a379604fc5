"""The counts of right and wrong diagnoses: the rules that count, the injected damage, and the stored document."""

import importlib
import json
from pathlib import Path
from types import SimpleNamespace as Fake

import numpy as np
import pandas as pd
import pytest

from sigdb.diagnosis.change import power
from sigdb.recording import Channel, Recording

ROOT = Path(__file__).parents[2]
DOCUMENT = json.loads((ROOT / "benchmarks" / "measured.json").read_text(encoding="utf-8"))
TEETH, RATE = 32, 12_800.0


@pytest.fixture(scope="module")
def measured():
    return importlib.import_module("measured")


@pytest.fixture(scope="module")
def cases():
    return importlib.import_module("measured_cases")


@pytest.fixture(scope="module")
def injection():
    return importlib.import_module("injection")


@pytest.fixture(scope="module")
def floor():
    return importlib.import_module("healthy_only")


@pytest.fixture(scope="module")
def gear():
    """A recording of 2 s with its angle: three mesh harmonics, errors of the teeth, noise; and another one of it."""

    def record(number):
        angle = 7.3 + number + 950.0 * np.arange(int(2 * RATE)) / RATE
        errors = 0.05 * np.random.default_rng(0).standard_normal(TEETH)
        noise = 0.1 * np.random.default_rng(number).standard_normal(angle.size)
        mesh = sum(np.cos(2 * np.pi * h * angle + h) / h for h in (1, 2, 3))
        x = mesh * (1 + errors[np.floor(angle).astype(int) % TEETH]) + noise
        channel = Channel(name="a1", samples=x, sampling_rate=RATE, unit="m/s^2")
        return Recording(source="gear", channels=(channel,)), angle

    return record(0), record(TEETH)


def test_the_page_is_made_of_the_stored_document(measured):
    assert measured.PAGE.read_text(encoding="utf-8") == measured.page(DOCUMENT)


@pytest.mark.parametrize("name", ["twin", "spectraquest"])
def test_a_section_has_at_least_sixty_questions_of_every_kind(name, cases):
    rows = DOCUMENT[name]["questions"]
    assert len(rows) >= 60
    assert [row["number"] for row in rows] == list(range(len(rows)))
    for kind in cases.KINDS:
        assert {row["loss"] for row in rows if row["kind"] == kind} == {None, *cases.LOSSES}
    assert {row["given"] for row in rows} == set(cases.GIVEN)


def test_the_stored_questions_are_those_of_the_benchmark(cases):
    machine = cases.TwinMachine()
    stored = DOCUMENT["twin"]["questions"]
    for question, row in zip(cases.questions(machine), stored, strict=True):
        assert (question.pair.kind, question.pair.run, question.angle, question.given) == (
            row["kind"],
            row["run"],
            row["angle"],
            row["given"],
        )
        assert row["loss"] == (question.injection.loss if question.injection else None)


AGAIN = (2, 33, 68)
"""Numbers of questions about the twin that are answered again: healthy, injected, and a sensor that fell off."""


@pytest.mark.parametrize("number", AGAIN)
def test_a_question_about_the_twin_has_the_stored_answer(number, measured, cases, monkeypatch):
    monkeypatch.setattr(power, "_MOST_TRIES", 160)  # other tests try fewer
    machine = cases.TwinMachine()
    question = list(cases.questions(machine))[number]
    row, stored = measured.answer(machine, question), DOCUMENT["twin"]["questions"][number]
    for name in ("answer", "outcome", "named", "power"):
        assert row[name] == stored[name]
    if not row["empty"]:
        assert row["score"] == pytest.approx(stored["score"], rel=1e-3)
        assert row["floor"]["value"] == pytest.approx(stored["floor"]["value"], rel=1e-3)


def _location(tooth, within=1):
    return Fake(tooth=tooth, low=tooth - within, high=tooth + within, within=within)


POWER = {"quantity": "stiffness_loss", "smallest": 0.3, "exceptions": [4]}


@pytest.mark.parametrize(
    ("kind", "teeth", "true", "loss", "power", "outcome"),
    [
        ("no change", [], None, None, POWER, "right"),
        ("level changed", [], None, None, POWER, "right"),
        ("one tooth", [_location(3)], None, None, None, "wrong"),
        ("cannot be judged", [], None, None, None, "abstains"),
        ("one tooth", [_location(9)], 9, 0.4, None, "right"),
        ("one tooth", [_location(10, within=0)], 9, 0.4, None, "right"),
        ("one tooth", [_location(1)], 32, 0.4, None, "right"),
        ("one tooth", [_location(12)], 9, 0.4, None, "wrong"),
        ("one tooth", [_location(12, within=2)], 10, 0.4, None, "right"),
        ("one tooth", [_location(9, within=3)], 9, 0.4, None, "abstains"),
        ("several teeth", [_location(9), _location(11)], 9, 0.4, None, "right"),
        ("several teeth", [_location(9), _location(20)], 9, 0.4, None, "wrong"),
        ("no change", [], 9, 0.4, POWER, "wrong"),
        ("no change", [], 9, 0.2, POWER, "missed"),
        ("no change", [], 4, 0.4, POWER, "missed"),
        ("cannot be judged", [], 9, 0.4, None, "abstains"),
    ],
)
def test_answers_count_by_the_rules_of_the_page(kind, teeth, true, loss, power, outcome, measured, injection, gear):
    (recording, angle), _ = gear
    begin = (10 * TEETH - angle[0]) / 950.0  # the average begins at the first contact of tooth 1
    track = pd.DataFrame({"time": [begin + 0.5], "speed_rpm": [60.0]})
    damage = None if true is None else injection.Injection(rig=0, loss=loss, tooth=true, seed=0)
    found = Fake(kind=kind, locations=teeth, signature=Fake(speed_track=track, gear=None, teeth=TEETH))
    row = {"empty": False, "power": power, "share_of_rms": 0.1}
    question = Fake(injection=damage, angle="tacho")
    assert measured.outcome(found, row, question, angle, recording)[0] == outcome


@pytest.mark.parametrize(
    ("kind", "outcome"), [("no change", "wrong"), ("one tooth", "wrong"), ("cannot be judged", "right")]
)
def test_only_an_abstention_is_right_without_the_gear(kind, outcome, measured):
    assert measured.outcome(Fake(kind=kind), {"empty": True}, None, None, None)[0] == outcome


@pytest.mark.parametrize("tooth", [1, 9, 32])
def test_an_injected_pulse_is_found_at_its_tooth(tooth, injection, floor, gear, monkeypatch):
    (recording, angle), (other, other_angle) = gear
    n = floor.STEPS * TEETH
    place = (np.arange(n) / floor.STEPS - floor.LAG + TEETH / 2) % TEETH - TEETH / 2
    mesh = np.cos(2 * np.pi * np.arange(n) / floor.STEPS)
    healthy = np.fft.rfft(sum(np.cos(2 * np.pi * h * np.arange(n) / floor.STEPS) for h in range(1, 7)))
    change = np.fft.rfft(np.exp(-0.5 * (place / 0.4) ** 2) * mesh)
    monkeypatch.setattr(injection, "difference", lambda *which: (healthy, change))
    damage = injection.Injection(rig=0, loss=0.4, tooth=tooth, seed=1, share_of_rms=0.2)
    run, share = damage.into(recording, "a1", angle)

    def mean(recording, angle):
        return floor.MeanTurn.of(recording.channel("a1").samples, angle, teeth=TEETH)

    assert share == 0.2
    undamaged, damaged = mean(recording, angle), mean(run, angle)
    added = np.fft.irfft(damaged.spectrum - undamaged.spectrum).std() / np.fft.irfft(undamaged.spectrum).std()
    assert added == pytest.approx(0.2, rel=0.02)
    reference = mean(other, other_angle)
    quiet, _ = floor.pulse(undamaged, reference, marked=True)
    value, at = floor.pulse(damaged, reference, marked=True)
    assert value > 5 * quiet
    assert abs((at - (tooth - 1) + TEETH / 2) % TEETH - TEETH / 2) < 1
    free, elsewhere = floor.pulse(damaged, reference, marked=False)
    assert free > 5 * quiet
    assert elsewhere == pytest.approx(at, abs=0.2)


def test_the_phase_of_the_mesh_gives_the_angle_but_for_its_beginning(injection, gear):
    (recording, angle), _ = gear
    off = injection.mesh_angle(recording, TEETH, near_rpm=1780.0) - angle
    middle = off[len(off) // 10 : -len(off) // 10]
    assert np.ptp(middle) < 0.05


def test_the_pitch_errors_of_a_twin_are_the_same_over_loads_and_differ_between_twins():
    twins = importlib.import_module("gearbox_twin")
    floor = importlib.import_module("healthy_only")

    def trace(seed, load, number):
        recording, angle = twins.Twin(seed=seed).record(load=load, number=number, seconds=2.0)
        mean = floor.MeanTurn.of(recording.channel("a1").samples, angle, teeth=TEETH)
        return mean.spectrum[np.concatenate(mean.bands()[:1])]

    def likeness(a, b):
        return abs(np.vdot(a, b)) / np.linalg.norm(a) / np.linalg.norm(b)

    near, far, other = trace(1, 40.0, 1), trace(1, 50.0, 2), trace(2, 40.0, 1)
    assert likeness(near, far) > 0.9
    assert likeness(near, other) < 0.8
