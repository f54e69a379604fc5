"""Unit: what healthy rows tell besides damage, and training and evaluation on measured rows and across."""

import shutil

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError, NotApplicableError
from sigdb.database import labelled_rows
from sigdb.ingest import IngestSettings, ingest
from sigdb.recognition import RecognitionSettings, TemplateBank, evaluate, train
from sigdb.recognition.splits.confounds import confounds, indicator_rows, logarithms
from sigdb.recognition.splits.healthy_only import healthy_only_answers

TEETH, SAMPLES = 12, 32
N = TEETH * SAMPLES


def averages(stream, tooth, mounting):
    """Four averages of a recording: a mesh, teeth of the machine, and noise; the mounting lifts a band of orders."""
    angle = 2 * np.pi * np.arange(N) / N
    errors = np.repeat(0.05 * np.random.default_rng(1).normal(size=TEETH), SAMPLES)
    x = np.cos(TEETH * angle) * (1 + errors) + mounting * 0.3 * np.cos(3 * TEETH * angle)
    if tooth:
        x[(tooth - 1) * SAMPLES : tooth * SAMPLES] *= 0.5
    return x + 0.02 * stream.normal(size=(4, N))


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Two machines that differ by their mounting, twelve recordings of each, half of them damaged."""
    folder, stream = tmp_path_factory.mktemp("measured"), np.random.default_rng(0)
    for machine in range(2):
        for number in range(12):
            tooth = 0 if number < 6 else 1 + (5 * number + machine) % TEETH
            facts = {"tooth": tooth, "machine": f"m{machine}", "torque": 20.0} | ({"load": 10.0} if number % 2 else {})
            tsa = averages(stream, tooth, machine)
            numbers = {"speed_rpm": 1500.0, "averages": 40, "scatter": 0.12}
            np.savez(folder / f"m{machine}-{number:02d}.npz", tsa=tsa, **numbers, **facts)
    settings = IngestSettings(averages_of="tsa", teeth=str(TEETH), samples_per_tooth=SAMPLES)
    ingest(folder, folder / "db", settings=settings, jobs=1)
    return sigdb.open(folder / "db")


def test_a_mounting_is_told_from_healthy_rows_and_a_load_that_does_nothing_is_not(measured):
    told = {each.column: each for each in confounds(measured)}
    assert set(told) == {"machine", "load"}
    assert told["machine"].accuracy == 1.0
    assert told["machine"].chance == 0.5
    assert abs(told["load"].accuracy - 0.5) < 0.3


def test_recordings_have_no_bank_of_templates(measured):
    with pytest.raises(NotApplicableError, match="db has no templates: recordings have none"):
        TemplateBank.of(measured)
    with pytest.raises(NotApplicableError, match="db has no templates: recordings have none"):
        TemplateBank.of(measured, cases=measured.cases().head(0), specimens=[7])


def test_recordings_of_one_damaged_tooth_say_how_to_get_others(tmp_path):
    stream = np.random.default_rng(1)
    for number, tooth in enumerate((0, 0, 3, 3)):
        facts = {"tooth": tooth, "speed_rpm": 1500.0, "averages": 40, "scatter": 0.12}
        np.savez(tmp_path / f"{number}.npz", tsa=averages(stream, tooth, 0), **facts)
    settings = IngestSettings(averages_of="tsa", teeth=str(TEETH), samples_per_tooth=SAMPLES)
    ingest(tmp_path, tmp_path / "db", settings=settings, jobs=1)
    with pytest.raises(InputError, match=r"location cannot be learnt.*label those that are there \(sigdb label\)"):
        train(sigdb.open(tmp_path / "db"), "location", split="recording")


def test_copies_of_a_file_are_one_recording(tmp_path):
    for name, tooth in (("a", 0), ("c", 3)):
        np.savez(tmp_path / f"{name}.npz", tsa=averages(np.random.default_rng(tooth), tooth, 0), tooth=tooth)
    shutil.copy(tmp_path / "a.npz", tmp_path / "b.npz")
    settings = IngestSettings(averages_of="tsa", teeth=str(TEETH), samples_per_tooth=SAMPLES)
    ingest(tmp_path, tmp_path / "db", settings=settings, jobs=1)
    rows = labelled_rows(sigdb.open(tmp_path / "db"))
    assert rows.groupby("recording").size().to_dict() == {"a.npz": 8, "c.npz": 4}
    assert rows["specimen"].nunique() == 2
    assert "sha256" not in rows


def test_a_torque_stands_for_a_load_that_is_not_stated(measured):
    rows = labelled_rows(measured)
    stated = measured.sql("select id, load, torque from features").set_index("id")
    assert (rows["load"] == stated["load"].fillna(stated["torque"])).all()
    assert set(rows["load"]) == {10.0, 20.0}


def test_a_model_of_recordings_is_evaluated_on_others_with_the_confound_in_its_notes(measured, few_trees):
    settings = RecognitionSettings(learner="lda", folds=3, false_alarm_rate=0.3)
    model = train(measured, "location", settings, split="recording")
    result = evaluate(model, measured)
    assert result.split == "recording"
    assert result.bound is None
    notes = {note.code: note for note in result.notes}
    assert "the law of measured rows is not known" in notes["no-bound"].text
    assert notes["confound"].values["column"] == "machine"
    assert notes["healthy-only"].values["area"] > 0.9
    assert result.specimens == pytest.approx(24 / 3, abs=1)


def test_the_healthy_only_detector_is_a_row_of_an_evaluation_of_detection(measured, few_trees):
    settings = RecognitionSettings(learner="lda", folds=3, false_alarm_rate=0.3)
    result = evaluate(train(measured, "detection", settings, split="recording"), measured)
    row = result.metrics["healthy_only"]
    assert row["p_detected"].value > 0.9
    assert "healthy_only" in result.differences
    assert "healthy-only" not in {note.code for note in result.notes}


def test_it_compares_each_row_with_healthy_rows_of_other_recordings(measured):
    rows = indicator_rows(measured, "tooth is not null")
    values, healthy = logarithms(rows), (rows["tooth"] == 0).to_numpy()
    expected = []
    for number in range(len(rows)):
        others = values[healthy & (rows["recording"] != rows["recording"].iloc[number]).to_numpy()]
        expected.append((((values[number] - others.mean(axis=0)) / others.std(axis=0, ddof=1)) ** 2).mean())
    answers = healthy_only_answers(measured, rows, 0.25)
    shift = answers.scores - np.log(expected)
    assert shift == pytest.approx(np.full(len(rows), shift[0]), abs=1e-9)
    assert 0.25 - 2 / healthy.sum() < answers.predicted[healthy].mean() <= 0.25
    assert healthy_only_answers(measured, rows[rows["tooth"] > 0].head(1), 0.25).predicted.shape == (1,)
