"""Unit: the command from recordings to signatures, on files that the test writes."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from sigdb.cli.main import cli
from sigdb.core.errors import InputError
from sigdb.recording import read_recording, recorded_signature

FS = 3200


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three recordings of 12 teeth at 20 rev/s with a tacho, the last one louder."""
    folder = tmp_path_factory.mktemp("recordings")
    theta = 2 * np.pi * 20 * np.arange(5 * FS) / FS
    stream = np.random.default_rng(0)
    for name, level in (("one", 1.0), ("two", 1.0), ("three", 2.0)):
        x = level * (np.cos(12 * theta) + 0.5 * np.cos(24 * theta + 1) + 0.3 * np.cos(13 * theta))
        x += 0.2 * stream.normal(size=x.size)
        columns = np.column_stack([x, np.cos(theta)])
        np.savetxt(folder / f"{name}.csv", columns, delimiter=",", header="a1,tacho", comments="", fmt="%.6f")
    return folder


def call(*arguments):
    return CliRunner().invoke(cli, ["signature", *(str(one) for one in arguments)])


def test_the_table_tells_what_the_library_finds(folder):
    path = folder / "one.csv"
    result = call(path, "--sampling-rate", FS, "--teeth", 12, "--tacho", "tacho")
    assert result.exit_code == 0, result.stderr
    found = recorded_signature(read_recording(path, sampling_rate=FS, tacho="tacho"), teeth=12)
    for said in (
        "1200.00 rpm (20.000 Hz)",
        f"{found.averages} revolutions; 0 dropped",
        f"{100 * found.kept:.1f} % of the record's",
        f"{found.indicators['fm4']:.4g}",
        "absolute: tooth 1 follows the tacho mark",
        "mesh + shaft",
    ):
        assert said in result.stdout, said
    for note in found.notes:
        assert note.text in result.stdout


def test_json_is_a_list_of_signatures_without_the_large_spectrum(folder):
    options = ("--sampling-rate", FS, "--teeth", 12, "--mesh-phase", "--format", "json")
    result = call(folder / "one.csv", folder / "three.csv", *options)
    assert result.exit_code == 0, result.stderr
    one, three = json.loads(result.stdout)
    assert one["speed_rpm"] == pytest.approx(1200, rel=1e-4)
    assert three["indicators"]["rms"] == pytest.approx(2 * one["indicators"]["rms"], rel=0.01)
    assert len(one["tsa"]) == 768
    assert not one["absolute"]
    assert "record_spectrum" not in one
    known = {(name, found) for name, found in zip(one["lines"]["name"], one["lines"]["stands_out"], strict=True)}
    assert {("mesh", True), ("mesh + shaft", True), ("mesh x2", True), ("mesh - shaft", False)} <= known


def test_several_recordings_are_a_history(folder):
    paths = [folder / f"{name}.csv" for name in ("one", "two", "three")]
    result = call(*paths, "--sampling-rate", FS, "--teeth", 12, "--tacho", "tacho", "--baseline", 2)
    assert result.exit_code == 0, result.stderr
    head, *table = [line.split() for line in result.stdout.split("History, oldest first\n")[1].splitlines()]
    assert [row[0] for row in table] == ["one.csv", "two.csv", "three.csv"]
    # Twice the envelope's deviation is 16 times its fourth moment, against the frozen mean of the first two.
    assert head[-1] == "NB4*"
    assert float(table[2][-1]) / float(table[0][-1]) == pytest.approx(16, rel=0.3)


def test_a_folder_gets_the_page_and_its_numbers(folder, tmp_path):
    options = ("--sampling-rate", FS, "--teeth", 12, "--tacho", "tacho", "--out", tmp_path / "report")
    result = call(folder / "one.csv", *options)
    assert result.exit_code == 0, result.stderr
    assert f"page: {tmp_path / 'report' / 'index.html'}" in result.stderr
    numbers = json.loads((tmp_path / "report" / "signature.json").read_text(encoding="utf-8"))
    assert "record_spectrum" in numbers["signatures"][0]
    assert numbers["history"] == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--teeth", 12, "--tacho", "tacho", "--mesh-phase"), "either --tacho or --mesh-phase"),
        (("--teeth", 12, "--tacho", "tacho", "--baseline", 1), "several"),
        (("--teeth", 0, "--mesh-phase"), "--teeth"),
        ((), None),
    ],
)
def test_wrong_options_are_told(folder, options, said):
    result = call(folder / "one.csv", "--sampling-rate", FS, *options)
    if said is None:
        assert isinstance(result.exception, InputError)
        assert "teeth is missing" in str(result.exception)
    else:
        assert (result.exit_code, said in result.stderr) == (2, True)


def test_a_recording_in_blocks_has_the_signature_of_the_whole(folder, monkeypatch):
    options = (folder / "one.csv", "--sampling-rate", FS, "--teeth", 12, "--tacho", "tacho")
    (whole,) = json.loads(call(*options, "--format", "json").stdout)
    (blocks,) = json.loads(call(*options, "--format", "json", "--in-blocks").stdout)
    assert blocks["tsa"] == pytest.approx(whole["tsa"])
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_BYTES", 10_000)
    result = call(*options)
    assert result.exit_code == 0, result.stderr
    assert "read in blocks: 1" in result.stdout
    assert f"{whole['indicators']['fm4']:.4g}" in result.stdout


def test_a_recording_that_is_too_large_and_not_read_in_blocks_is_refused(tmp_path, monkeypatch):
    np.savez(tmp_path / "run.npz", a=np.random.default_rng(0).normal(size=5000))
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_BYTES", 10_000)
    with pytest.raises(InputError, match="more than 10000; cut it into shorter recordings, or write it as one of text"):
        CliRunner().invoke(
            cli, ["signature", str(tmp_path / "run.npz"), "--teeth", "12", "--mesh-phase"], catch_exceptions=False
        )


def test_the_default_gear_is_that_of_diagnose(folder):
    options = ("--sampling-rate", FS, "--rig", "nasa-spiral-bevel", "--tacho", "tacho", "--format", "json")
    result = call(folder / "one.csv", *options)
    assert result.exit_code == 0, result.stderr
    (found,) = json.loads(result.stdout)
    assert (found["gear"], found["teeth"]) == ("pinion", 12)


def test_a_missing_fact_is_named_by_its_option(folder):
    error = call(folder / "one.csv", "--teeth", 12, "--tacho", "tacho").exception
    assert isinstance(error, InputError)
    assert "give --sampling-rate, in Hz, or the column of times (--time)" in str(error)
