"""The command from files of recordings to a diagnosis: what it finds, and what it refuses in one line."""

import json

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.recognition import TemplateBank
from sigdb.recording import Surroundings, synthetic_recording

RATE = 102.4e3
READ = ("--rig", "nasa-spiral-bevel", "--sampling-rate", RATE)
TACHO = (*READ, "--tacho", "tacho")


def surroundings(offset):
    """Another speed in each; a path of 3 V s/m with a resonance above the third mesh harmonic; coloured noise."""
    return Surroundings(
        speed={"offset": offset, "depth": 0.005, "period": 0.2},
        path={"frequency": 9000.0, "damping_ratio": 0.05, "gain": 3.0},
        noise={"snr_db": 0.0, "corner_frequency": 8000.0},
        tacho={"jitter": 1e-6},
    )


def write(path, recording):
    x, tacho = (channel.samples for channel in recording.channels)
    columns = np.column_stack([x, tacho])
    np.savetxt(path, columns, delimiter=",", header="pinion-vertical,tacho", comments="", fmt="%.6g")


@pytest.fixture(scope="module")
def files(tmp_path_factory, few_draws):
    """A healthy gear, one with damage at its sixth tooth, and the sixth twice as loud; noise; a short record."""
    folder = tmp_path_factory.mktemp("recordings")
    rig, errors = sigdb.load_transmission("nasa-spiral-bevel"), 2e-6 * np.cos(np.arange(12.0) ** 2)
    damages = {"healthy": None, "again": None, "sixth": sigdb.Damage(tooth=6, stiffness_loss=0.4)}
    for i, (name, damage) in enumerate(damages.items()):
        recording = synthetic_recording(
            rig,
            damage,
            sampling_rate=RATE,
            revolutions=102,
            index_errors=errors - errors.mean(),
            surroundings=surroundings(0.002 * i),
            seed=i,
        )
        write(folder / f"{name}.csv", recording)
    lines = (folder / "sixth.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (folder / "short.csv").write_text("".join(lines[:500]), encoding="utf-8")
    noise = np.random.default_rng(0).standard_normal(len(lines) - 1)
    tacho = np.array([float(line.split(",")[1]) for line in lines[1:]])
    columns = np.column_stack([noise, tacho])
    np.savetxt(folder / "noise.csv", columns, delimiter=",", header="a1,tacho", comments="", fmt="%.6g")
    return folder


def test_the_answer_is_on_the_terminal(leave, files, folder):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures")
    code, out, err = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    assert (code, err) == (0, "")
    assert out.startswith("Damage at tooth 6.\nProbability of damage ")
    assert "nearest templates" in out
    assert "notes\n" in out
    assert "\n  The path from the mesh to the sensor is that of mesh harmonics 1, 2, 3" in out
    assert "missing" not in out


def test_a_healthy_gear_is_not_called_damaged(leave, files, folder):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures", "--format", "json")
    code, out, _ = leave("diagnose", files / "again.csv", *TACHO, *options)
    assert code == 0
    found = json.loads(out)
    assert (found["kind"], found["answer"], found["severity"]) == ("none", "No tooth damage found.", None)


def test_json_and_page_tell_the_same(leave, files, folder, tmp_path):
    out = tmp_path / "report"
    options = ("--healthy", files / "healthy.csv", "--model", folder / "location", "--format", "json", "--out", out)
    code, text, err = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    assert (code, err) == (0, f"page: {out / 'index.html'}\n")
    found = json.loads(text)
    assert (found["kind"], found["answer"], found["absolute"]) == ("tooth", "Damage at tooth 6.", True)
    loss = next(one for one in found["severity"] if one["target"] == "stiffness_loss")
    assert loss["low"] <= 0.4 <= loss["high"]
    written = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert {name: written[name] for name in found} == found
    assert set(map(len, written["signals"].values())) == {768}
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "<strong>Damage at tooth 6.</strong>" in page
    assert page.count("<img") == 3
    assert "<script" not in page


def test_recordings_that_are_too_large_are_diagnosed_in_blocks(leave, files, folder, monkeypatch):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures", "--format", "json")
    _, whole, _ = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_BYTES", 100_000)
    monkeypatch.setattr("sigdb.recording.files.formats.contents.BLOCK_VALUES", 20_000)
    with pytest.raises(InputError, match="in blocks"):
        sigdb.read_recording(files / "sixth.csv", sampling_rate=RATE)
    code, blocks, err = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    assert (code, err) == (0, "")
    expected, found = json.loads(whole), json.loads(blocks)
    assert found["answer"] == expected["answer"] == "Damage at tooth 6."
    assert found["p_damage"] == pytest.approx(expected["p_damage"])


def test_without_a_tacho_teeth_are_counted_from_the_beginning(leave, files, folder):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures", "--mesh-phase", "--format", "json")
    code, out, err = leave("diagnose", files / "sixth.csv", *READ, *options)
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert not found["absolute"]
    assert [note["code"] for note in found["missing"]] == ["no-tacho-mark", "speed-doubt"]
    assert found["missing"][1]["text"].startswith("A reliable speed in the healthy recording: ")
    assert found["p_damage"] > 0.9


def test_without_a_healthy_recording_it_is_said_what_is_missing(leave, files, folder):
    code, out, _ = leave("diagnose", files / "sixth.csv", *TACHO, "--db", folder / "signatures", "--unit", "m/s")
    assert code == 0
    assert out.startswith("Outside the database: neither a healthy gear nor any simulated damage fits")
    assert "missing\n  A healthy recording of the same rig by the same channel" in out


@pytest.mark.parametrize(("rate", "said"), [(RATE / 4, "0.251 times"), (RATE, None)])
def test_a_speed_far_from_the_rigs_asks_for_the_sampling_rate(leave, files, folder, monkeypatch, rate, said):
    """Templates that are made for the recording have its speed, so that they say nothing."""
    stored = TemplateBank.of(sigdb.open(folder / "signatures"))
    monkeypatch.setattr("sigdb.diagnosis.diagnose_recording.rig_bank", lambda *args, **options: stored)
    options = (*READ[:2], "--sampling-rate", rate, "--tacho", "tacho", "--format", "json")
    code, out, _ = leave("diagnose", files / "sixth.csv", *options)
    assert code == 0
    notes = [note["text"] for note in json.loads(out)["notes"] if note["code"] == "far-from-rig-speed"]
    assert len(notes) == (said is not None)
    if said:
        assert f"{said} the rig's operating speed of 14400 rpm" in notes[0]
        assert notes[0].endswith("check the sampling rate and the tacho.")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["{files}/nothing.csv", *TACHO], "nothing.csv"),
        (["{files}/sixth.csv", *TACHO, "--rig", "nothing"], "no built-in rig 'nothing'"),
        (["{files}/sixth.csv", *TACHO, "--rig", "two-stage-gearbox"], "has 2 meshes"),
        (["{files}/sixth.csv", *TACHO, "--gear", "wheel"], "gear = 'wheel' is not a gear of nasa-spiral-bevel"),
        (["{files}/sixth.csv", *TACHO, "--sensor", "wheel"], "sensor = 'wheel' is not a sensor of nasa-spiral-bevel"),
        (["{files}/sixth.csv", *TACHO, "--db", "{db}", "--sensor", "wheel"], "wheel"),
        (["{files}/sixth.csv", *TACHO, "--channel", "a9"], "a9"),
        (["{files}/sixth.csv", *READ], "no channel is known as its tacho"),
        (["{files}/sixth.csv", *TACHO, "--unit", "g", "--db", "{db}"], "the simulated sensor in 'm/s'"),
        (["{files}/short.csv", *TACHO, "--db", "{db}"], "short.csv"),
        (["{files}/sixth.csv", *TACHO, "--db", "{files}"], "is not a sigdb database"),
        (["{files}/sixth.csv", *TACHO, "--model", "{files}"], "is not a model folder"),
        (["{files}/sixth.csv", *TACHO, "--model", "{model}", "--db", "{db}"], "model and database are given together"),
    ],
)
def test_bad_input_is_told_in_one_line(leave, files, folder, tmp_path, arguments, says):
    names = {"files": files, "db": folder / "signatures", "model": folder / "location"}
    code, out, err = leave("diagnose", *(str(one).format(**names) for one in arguments), "--out", tmp_path / "report")
    assert (code, out) == (2, "")
    (line,) = err.splitlines()
    assert line.startswith("sigdb: error: ")
    assert says in line
    assert not list(tmp_path.iterdir())


def test_two_sources_of_the_angle_are_refused(leave, files):
    code, out, err = leave("diagnose", files / "sixth.csv", *TACHO, "--mesh-phase")
    assert (code, out) == (2, "")
    assert "Give either --tacho or --mesh-phase." in err
