"""Unit: a model's folder gives the same model back, or says what is wrong with it."""

import functools
import hashlib
import json
import os
import pickle
import shutil
import tracemalloc
import zipfile
from dataclasses import replace

import joblib
import numpy as np
import pytest
import skops.io
from numpy.testing import assert_array_equal

import sigdb
from sigdb.core.errors import InputError, SigdbError
from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.recognition import evaluate, load_model, save_model
from sigdb.recognition.estimators.registry import trusted_types

FILES = ["model.json", "model.skops", "probe.npz"]
COMMAND = "sigdb train somewhere --target location --out model --learner lda"


@pytest.fixture(scope="module")
def saved_models(location_model, severity_model, database, held_out, tmp_path_factory):
    """A model of each target, its evaluation and its folder."""
    saved = {}
    for target, model in (("location", location_model), ("severity", severity_model)):
        folder = tmp_path_factory.mktemp(target) / "made" / "model"
        evaluation = evaluate(model, database, bound=False)
        save_model(model, folder, evaluation=evaluation, probe=held_out, command=COMMAND)
        saved[target] = model, evaluation, folder
    return saved


@pytest.fixture(scope="module", params=["location", "severity"])
def saved(request, saved_models):
    return saved_models[request.param]


def with_templates(saved):
    """The model with templates as its learner, and its evaluation."""
    model, evaluation, _ = saved
    return replace(model, learner="templates"), replace(evaluation, learner="templates")


@pytest.mark.parametrize("target", ["location", "severity"])
def test_a_model_of_templates_carries_its_bank(saved_models, held_out, tmp_path, target):
    made, evaluation = with_templates(saved_models[target])
    save_model(made, tmp_path / "model", evaluation=evaluation, probe=held_out, command=COMMAND)
    loaded, some = load_model(tmp_path / "model"), held_out[::7]
    assert_array_equal(np.asarray(loaded.predict(some)), np.asarray(made.predict(some)))
    with np.load(tmp_path / "model" / "probe.npz") as probe:
        assert probe["tsa"].shape == (8, 768)
    if target == "location":
        said = made.estimators["templates"].assess(some)
        assert said.equals(loaded.estimators["templates"].assess(some))


def resealed(folder):
    """Make ``model.json`` describe the files as they are now, as somebody who changes them on purpose would."""
    described = unsealed((folder / "model.json").read_bytes(), name="model.json")
    described["files"] = {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in described["files"]}
    (folder / "model.json").write_bytes(sealed_json(described))


@pytest.fixture
def copied(saved_models, tmp_path):
    """The folder of the location model, to be broken."""
    return shutil.copytree(saved_models["location"][2], tmp_path / "model")


def test_a_loaded_model_gives_the_same_answers(saved, held_out):
    model, _, folder = saved
    loaded, some = load_model(folder), held_out[::7]
    for name, estimator in model.estimators.items():
        assert_array_equal(np.asarray(loaded.estimators[name].predict(some)), np.asarray(estimator.predict(some)))
    assert_array_equal(np.asarray(loaded.predict(some)), np.asarray(model.predict(some)))
    for name in ("target", "learner", "seed", "trained_on", "database_hash", "split_hash", "sensor", "rows"):
        assert getattr(loaded, name) == getattr(model, name)
    assert sigdb.load_model is load_model


def test_a_loaded_model_is_evaluated_to_the_same_figures(saved, database):
    _, evaluation, folder = saved
    again = evaluate(load_model(folder), database, bound=False)
    assert repr(again) == repr(evaluation)


def test_the_description_holds_figures_hashes_and_versions(saved):
    model, evaluation, folder = saved
    described = json.loads((folder / "model.json").read_text())
    assert set(described["versions"]) == {"sigdb", "scikit-learn", "python"}
    assert described["database_hash"] == model.database_hash
    for name, metrics in evaluation.metrics.items():
        for key, metric in metrics.items():
            stored = described["evaluation"]["metrics"][name][key]
            ends = [None if np.isnan(end) else end for end in (metric.value, metric.low, metric.high)]
            assert [stored["value"], stored["low"], stored["high"]] == ends


def test_the_card_says_what_was_measured_and_how_to_make_it_again(saved):
    model, evaluation, folder = saved
    card = (folder / "README.md").read_text()
    assert evaluation.split in card
    assert f"{evaluation.rows} rows of\n{evaluation.specimens} specimens" in card
    assert f"{model.rows} simulated signatures" in card
    assert COMMAND in card
    table = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in card.splitlines() if line.startswith("|")
    ]
    head, _, *lines = table
    assert head == ["metric", *(f"{one} (the model)" if one == model.learner else one for one in evaluation.metrics)]
    every = [figure for figures in evaluation.metrics.values() for figure in figures.items()]
    known = {key for key, one in every if not np.isnan(one.value)}
    assert len(lines) == len(known)
    # Each column of the card holds the figures of its estimator, in the order in which evaluation gives them.
    for column, name in enumerate(evaluation.metrics, start=1):
        printed = [line[column] for line in lines if line[column]]
        figures = [one for key, one in evaluation.metrics[name].items() if key in known]
        expected = [
            "-" if np.isnan(one.value) else f"{one.value:.3f} [{one.low:.3f}, {one.high:.3f}]" for one in figures
        ]
        assert sorted(printed) == sorted(expected)
    first = "accuracy" if model.target == "location" else "mae_stiffness_loss"
    assert lines[0][1] == str(evaluation.metrics["lda"][first])


def test_a_changed_byte_in_the_estimators_is_noticed(copied):
    path = copied / "model.skops"
    content = path.read_bytes()
    with zipfile.ZipFile(path) as archive:
        entry = max(archive.infolist(), key=lambda one: one.compress_size)
    # Local header: 30 bytes, the name; then the data.
    start = entry.header_offset + 30 + len(entry.filename)
    for offset in (start, start + entry.compress_size // 2, start + entry.compress_size - 1):
        changed = bytearray(content)
        changed[offset] ^= 0xFF
        path.write_bytes(changed)
        with pytest.raises(SigdbError, match="model"):
            load_model(copied)


def test_a_changed_byte_in_the_probe_is_noticed(copied):
    path = copied / "probe.npz"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(SigdbError, match="model"):
        load_model(copied)


def test_answers_that_changed_are_noticed(copied):
    with np.load(copied / "probe.npz") as probe:
        arrays = dict(probe)
    arrays["expected"] = arrays["expected"] + 1e-3
    np.savez(copied / "probe.npz", **arrays)
    resealed(copied)
    with pytest.raises(
        SigdbError, match=r"answers on its probe have changed \(saved with scikit-learn .*train it again"
    ):
        load_model(copied)


def test_the_probe_is_no_empty_check(saved, held_out):
    _, _, folder = saved
    with np.load(folder / "probe.npz") as probe:
        assert 1 <= len(probe["teeth"]) == len(probe["expected"]) <= 8
        stored = {hashlib.sha256(row.tobytes()).hexdigest() for row in probe["wigner_ville"]}
    known = {hashlib.sha256(np.asarray(row).tobytes()).hexdigest() for row in held_out["wigner_ville"]}
    assert stored <= known


@pytest.mark.parametrize("dump", [pickle.dump, joblib.dump], ids=["pickle", "joblib"])
def test_a_pickle_is_refused(copied, dump):
    with (copied / "model.skops").open("wb") as file:
        dump({"lda": None}, file)
    resealed(copied)
    with pytest.raises(InputError, match="not a readable model"):
        load_model(copied)


class Bomb:
    """A type of this test; it must never be made by loading."""

    def __init__(self):
        self.fuse = 1

    def __setstate__(self, state):
        raise AssertionError("an untrusted type was made")


@pytest.mark.parametrize(
    ("value", "named"), [(functools.partial(print, 1), "functools.partial"), (Bomb(), "Bomb")], ids=["partial", "class"]
)
def test_a_type_that_is_not_trusted_is_refused(copied, value, named):
    estimators = skops.io.load(
        copied / "model.skops", trusted=skops.io.get_untrusted_types(file=copied / "model.skops")
    )
    skops.io.dump(estimators | {"extra": value}, copied / "model.skops")
    resealed(copied)
    with pytest.raises(InputError, match=rf"types that are not trusted: .*{named}"):
        load_model(copied)


@pytest.mark.parametrize("name", FILES)
def test_a_missing_file_is_named(copied, name):
    (copied / name).unlink()
    with pytest.raises(InputError, match=rf"not a model folder: .*{name} is missing; make one with: sigdb train"):
        load_model(copied)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("kept", [0, 0.5], ids=["empty", "cut"])
def test_a_cut_file_is_no_model(copied, name, kept):
    content = (copied / name).read_bytes()
    (copied / name).write_bytes(content[: int(kept * len(content))])
    if name != "model.json":
        resealed(copied)
    with pytest.raises(InputError, match="not a readable model"):
        load_model(copied)


def test_a_folder_without_a_model_is_named(tmp_path):
    with pytest.raises(InputError, match=r"empty is not a model folder: .*model\.json is missing"):
        load_model(tmp_path / "empty")


@pytest.mark.parametrize("content", ["[]", "{}", '{"trained_on": 3}', '{"sha256": "0"}', '{"sha256": []}', "nonsense"])
def test_a_description_of_something_else_is_no_model(copied, content):
    (copied / "model.json").write_text(content)
    with pytest.raises(InputError, match="not a readable model"):
        load_model(copied)


@pytest.mark.parametrize("content", [[1], {"other": 1}], ids=["list", "another"])
def test_estimators_of_something_else_are_no_model(copied, content):
    skops.io.dump(content, copied / "model.skops")
    resealed(copied)
    with pytest.raises(InputError, match="not a readable model"):
        load_model(copied)


def test_names_in_the_file_are_public_and_old_ones_are_read(saved_models, held_out, tmp_path):
    """A model of sigdb 0.1.0 names the modules of its time, and calls the reduced chi-square a misfit."""
    model, evaluation = with_templates(saved_models["location"])
    save_model(model, tmp_path, evaluation=evaluation, probe=held_out, command="train")
    path = tmp_path / "model.skops"
    with zipfile.ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    assert b'"sigdb.recognition.' not in entries["schema.json"]
    old = entries["schema.json"].replace(b'"sigdb.recognition"', b'"sigdb.recognition.template_location"')
    entries["schema.json"] = old.replace(b'"reduced_chi2_threshold_"', b'"misfit_threshold_"')
    assert entries["schema.json"] != old
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    resealed(tmp_path)
    loaded = load_model(tmp_path).estimator
    assert loaded.reduced_chi2_threshold_ == model.estimator.reduced_chi2_threshold_
    assert loaded.assess(held_out[:5]).equals(model.estimator.assess(held_out[:5]))


def digits_of(content):
    return [place for place, byte in enumerate(content) if chr(byte).isdigit()]


def test_a_flipped_digit_anywhere_in_the_description_is_refused(copied):
    path = copied / "model.json"
    content = path.read_bytes()
    places = digits_of(content)
    assert len(places) > 1000
    for place in [*places[:70], *places[70::40]]:
        changed = bytearray(content)
        changed[place] = ord("7") if content[place] != ord("7") else ord("3")
        path.write_bytes(changed)
        with pytest.raises(InputError, match="not a readable model"):
            load_model(copied)


@pytest.mark.parametrize("change", [bytes.upper, lambda one: one.replace(b"\n", b"\r\n"), lambda one: one + b" "])
def test_another_form_of_the_description_is_refused(copied, change):
    path = copied / "model.json"
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(InputError, match="not a readable model"):
        load_model(copied)


def test_a_description_of_an_earlier_version_has_no_seal_and_is_read(copied, held_out):
    sealed = load_model(copied)
    described = unsealed((copied / "model.json").read_bytes(), name="model.json")
    described["sha256"] = described.pop("files")
    (copied / "model.json").write_text(json.dumps(described))
    assert_array_equal(load_model(copied).predict(held_out[::7]), sealed.predict(held_out[::7]))
    described["sha256"]["probe.npz"] = described["sha256"]["model.skops"]
    (copied / "model.json").write_text(json.dumps(described))
    with pytest.raises(InputError, match=r"probe\.npz is not the file that was saved"):
        load_model(copied)


def test_a_model_that_is_saved_twice_has_the_same_bytes(copied, saved_models, held_out):
    model, evaluation, folder = saved_models["location"]
    again = replace(model, estimators=skops.io.loads(skops.io.dumps(model.estimators), trusted=trusted_types()))
    save_model(again, copied, evaluation=evaluation, probe=held_out, command=COMMAND)
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["README.md", "model.json", "model.skops", "probe.npz"]
    for name in names:
        assert (copied / name).read_bytes() == (folder / name).read_bytes(), name


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("kind", ["folder", "zeros", "elsewhere", *(["pipe"] if hasattr(os, "mkfifo") else [])])
def test_only_regular_files_of_the_folder_are_read(copied, name, kind, tmp_path):
    path = copied / name
    path.rename(tmp_path / name)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero" if kind == "zeros" else tmp_path / name)
    rule = "is a link to a file elsewhere" if kind in ("zeros", "elsewhere") else "is not a regular file"
    with pytest.raises(InputError, match=rf"^{copied}: {name} {rule}"):
        load_model(copied)


def test_a_link_within_the_folder_is_followed(copied):
    (copied / "probe.npz").rename(copied / "kept.npz")
    (copied / "probe.npz").symlink_to("kept.npz")
    assert load_model(copied).target == "location"


@pytest.mark.parametrize(("name", "member"), [("model.skops", "schema.json"), ("probe.npz", "expected.npy")])
def test_a_member_that_expands_beyond_all_models_is_refused_before_memory_is_spent(copied, name, member):
    with zipfile.ZipFile(copied / name, "w", zipfile.ZIP_DEFLATED) as archive, archive.open(member, "w") as file:
        for _ in range(40):
            file.write(bytes(2**20))
    resealed(copied)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=rf"^{copied}: {name} expands \d+ bytes to 41943040, which no model does"):
            load_model(copied)
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()


def test_saving_again_replaces_the_model(copied, saved_models, held_out):
    model, evaluation, _ = saved_models["severity"]
    save_model(model, copied, evaluation=evaluation, probe=held_out, command="again")
    assert load_model(copied).target == "severity"
    assert "# Severity of tooth damage" in (copied / "README.md").read_text()
    assert {path.name for path in copied.iterdir()} == {"model.skops", "model.json", "probe.npz", "README.md"}
