"""A rig of known answer: the wheel's frequency gives the bearings, and says nothing of the damping."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core import InputError
from sigdb.identification import Targets, identify, write_identification
from sigdb.transmission import load_transmission

STIFFNESS, MASS = 0.9e6, 100.0
FREQUENCY = np.sqrt(2 * STIFFNESS / MASS) / (2 * np.pi)
TARGETS = Targets(
    modes=[{"frequency_hz": FREQUENCY, "relative_error": 0.01, "moves": "shaft bending"}],
    deflections=[
        {
            "sensor": "across",
            "force_at": "across",
            "force": 1000.0,
            "deflection": 1000 / (2 * STIFFNESS),
            "relative_error": 0.02,
            "held_out": True,
        }
    ],
)
MEMBERS = 12


@pytest.fixture(scope="module")
def whole(wheel, tmp_path_factory):
    folder = tmp_path_factory.mktemp("search")
    progress = []
    result = identify(wheel, TARGETS, members=MEMBERS, seed=5, folder=folder, on_progress=progress.append)
    return result, folder, progress


def test_the_posterior_is_that_of_the_frequency(whole):
    """The shaft gives 1 % of the bearings' compliance; k has twice the relative error of f, which is 0.02."""
    result, *_ = whole
    stiffness = result.table()["bearings.left.stiffness"]
    assert stiffness.mean() == pytest.approx(STIFFNESS, rel=0.03)
    assert stiffness.std() == pytest.approx(0.02 * STIFFNESS, rel=0.6)
    assert all(rig.bearings["right"].stiffness == rig.bearings["left"].stiffness for rig in result.rigs)
    posterior = result.posterior()
    assert list(posterior["is_identified"]) == [path == "bearings.left.stiffness" for path in posterior.index]
    assert result.level == pytest.approx(11 / 13)


def test_what_is_held_out_is_predicted_by_the_members(whole):
    result, *_ = whole
    prediction = result.predictions().iloc[-1]
    assert prediction["held_out"]
    assert prediction["predicted_low"] < prediction["stated"] < prediction["predicted_high"]
    stiffness = result.table()["bearings.left.stiffness"]
    assert_allclose([member.predicted[-1] for member in result.members], 500 / stiffness, rtol=0.02)


def test_a_stopped_search_goes_on_with_the_same_result(whole, wheel, tmp_path):
    result, folder, progress = whole
    assert [one.done for one in progress] == list(range(1, MEMBERS + 1))
    lines = (folder / "search.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "search.jsonl").write_text("".join(lines[:9]) + lines[9][:40], encoding="utf-8")
    again, progress = [], []
    again = identify(wheel, TARGETS, members=MEMBERS, seed=5, folder=tmp_path, on_progress=progress.append)
    assert progress[0].before == 7
    assert again.as_json() == result.as_json()
    assert (tmp_path / "search.jsonl").read_text(encoding="utf-8") == "".join(lines)


def test_a_folder_keeps_one_search(whole, wheel, tmp_path):
    _, folder, _ = whole
    with pytest.raises(InputError, match="holds the search of another rig, other targets or another seed"):
        identify(wheel, TARGETS, members=MEMBERS, seed=6, folder=folder)
    (tmp_path / "search.jsonl").write_text("[]\n", encoding="utf-8")
    with pytest.raises(InputError, match="is no record of a search; remove it, or choose another folder"):
        identify(wheel, TARGETS, members=MEMBERS, folder=tmp_path)


def test_the_files_hold_the_rigs_and_the_tables(whole, tmp_path):
    result, *_ = whole
    former = tmp_path / "members" / "wheel-99.toml"
    former.parent.mkdir()
    former.touch()
    document, summary, *rigs = write_identification(result, tmp_path)
    assert not former.exists()
    assert json.loads(document.read_text(encoding="utf-8"))["posterior"][0]["low"] == 0.01
    text = summary.read_text(encoding="utf-8")
    assert "The targets do not identify damping_ratio:" in text
    assert "12 of 12 rigs meet the targets" in text
    assert [load_transmission(path) for path in rigs] == list(result.rigs)


@pytest.mark.parametrize(
    ("members", "rig", "sentence"),
    [
        (1, None, "members = 1 must be a whole number, 2 or more"),
        (2, "bare", "has no assumed number with a range to search in"),
    ],
)
def test_what_cannot_be_searched_is_refused(wheel, wheel_text, tmp_path, members, rig, sentence):
    if rig == "bare":
        lines = (line for line in wheel_text.splitlines() if not line.startswith("assumed"))
        rig = tmp_path / "bare.toml"
        rig.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        identify(rig or wheel, TARGETS, members=members)
