"""Verification: rows that another program exports give a model of simulated rows the answers that they had."""

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.ingest import IngestSettings, ingest
from sigdb.recognition import evaluate


@pytest.fixture(scope="module")
def exported(held_out):
    """Some rows of specimens that the model has not seen, as averages with labels."""
    rows = held_out.iloc[:: len(held_out) // 80]
    facts = {name: rows[name].to_numpy() for name in ("tooth", "speed_rpm", "torque", "averages", "scatter")}
    return {"tsa": np.array(rows["tsa"].tolist()), **facts}, rows


@pytest.fixture
def ingested(tmp_path):
    """Called with arrays, and settings that differ: the database of them."""

    def make(arrays, *, teeth="12", unit="m/s", samples=None):
        np.savez(tmp_path / "a.npz", **arrays)
        samples = samples or arrays["tsa"].shape[1] // 12
        settings = IngestSettings(
            averages_of="tsa", teeth=teeth, samples_per_tooth=samples, reading={"units": unit} if unit else {}
        )
        ingest(tmp_path, tmp_path / "db", settings=settings, jobs=1)
        return sigdb.open(tmp_path / "db")

    return make


def test_measured_rows_are_answered_as_simulated_ones_with_the_same_averages(exported, ingested, location_model):
    arrays, rows = exported
    there = ingested(arrays)
    predicted = location_model.estimator.predict(rows)
    result = evaluate(location_model, there)
    right = np.mean(predicted == rows["tooth"].to_numpy())
    assert result.metrics[location_model.learner]["accuracy"].value == pytest.approx(right, abs=1e-9)
    notes = {note.code: note.text for note in result.notes}
    assert "The sensor tsa is taken for pinion-vertical, gears of 12 teeth" in notes["mapping"]
    assert "Gain and path stay" in notes["mapping"]
    assert "outside-training" not in notes


def test_a_condition_selects_measured_rows(exported, ingested, location_model):
    arrays, rows = exported
    result = evaluate(location_model, ingested(arrays), where="tooth = 0 or tooth > 6")
    assert result.rows == int(((rows["tooth"] == 0) | (rows["tooth"] > 6)).sum())


def test_another_gain_is_noted(exported, ingested, location_model):
    arrays, _ = exported
    result = evaluate(location_model, ingested(arrays | {"tsa": 50 * arrays["tsa"], "scatter": 50 * arrays["scatter"]}))
    notes = {note.code: note for note in result.notes}
    assert notes["outside-training"].values["share"] == 1.0
    assert "check the unit" in notes["outside-training"].text


@pytest.mark.parametrize(
    ("more", "options", "says"),
    [
        ({}, {"unit": "m/s^2"}, r"has averages in m/s\^2, and the model reads m/s;"),
        ({}, {"teeth": "13"}, "has gears of 13 teeth, and the model was trained on 12; train on simulated rows"),
        ({}, {"samples": 16}, "has averages of 16 samples a tooth, and the model reads"),
        ({"tooth": "unknown"}, {}, "no row has a result and a known tooth; enter labels with sigdb label"),
        (
            {"sensor": ["a", "b"]},
            {},
            "has rows of the sensors a, b, and the model reads one .*--where \"sensor = 'a'\"",
        ),
    ],
)
def test_rows_that_do_not_fit_are_refused_with_the_remedy(exported, ingested, location_model, more, options, says):
    arrays = dict(exported[0])
    for name, value in more.items():
        arrays[name] = np.resize(value, len(arrays["tsa"]))
    with pytest.raises(InputError, match=says):
        evaluate(location_model, ingested(arrays, **options))
