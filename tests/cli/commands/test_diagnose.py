"""The command from files of recordings to a diagnosis: what it finds, and what it refuses in one line."""

import json

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.diagnosis.stored_reference import SimulatedTemplates
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
def files(tmp_path_factory, few_tries):
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


def test_the_answer_is_on_the_terminal_and_damage_has_its_exit_code(leave, files, folder):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures")
    code, out, err = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    assert (code, err) == (1, "")
    assert out.startswith("One tooth stands out: 6")
    assert "False alarms: at most one in " in out
    assert "\n  tooth  changed     tooth 6\n" in out
    assert "assumed\n  The stored templates at " in out
    assert "missing" not in out


def test_a_healthy_gear_is_not_called_damaged(leave, files, folder):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures", "--format", "json")
    code, out, _ = leave("diagnose", files / "again.csv", *TACHO, *options)
    found = json.loads(out)
    assert (code, found["exit_code"], found["severity"], found["teeth"]) == (0, 0, None, [])
    assert found["kind"] in ("no change", "level changed")
    assert found["power"]["smallest"] <= 0.4
    assert "would have been seen at any tooth with probability 0.95" in found["answer"]


def test_json_and_page_tell_the_same(leave, files, folder, tmp_path):
    out = tmp_path / "report"
    options = ("--healthy", files / "healthy.csv", "--model", folder / "location", "--format", "json", "--out", out)
    code, text, err = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    assert (code, err) == (1, f"page: {out / 'index.html'}\n")
    found = json.loads(text)
    assert (found["kind"], found["absolute"], found["teeth"][0]["tooth"]) == ("one tooth", True, 6)
    loss = next(one for one in found["severity"] if one["target"] == "stiffness_loss")
    assert loss["low"] <= 0.4 <= loss["high"]
    written = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert {name: written[name] for name in found} == found
    assert set(map(len, written["signals"].values())) == {768}
    page = (out / "index.html").read_text(encoding="utf-8")
    assert f"<strong>{found['answer']}</strong>" in page
    assert page.count("<img") == 3
    assert "<script" not in page


def test_a_tooth_count_alone_is_enough_and_several_healthy_recordings_are_counted(leave, files):
    """No rig: a pulse stands out of what two healthy recordings show, or its power is stated."""
    reading = ("--sampling-rate", RATE, "--tacho", "tacho", "--teeth", 12, "--format", "json")
    healthy = ("--healthy", files / "healthy.csv", "--healthy", files / "again.csv")
    code, out, err = leave("diagnose", files / "sixth.csv", *reading, *healthy)
    found = json.loads(out)
    assert (code, err, found["severity"], found["statistics"]["template"]) == (found["exit_code"], "", None, None)
    assert found["false_alarms"]["pieces"] > 40
    assert found["kind"] != "no change" or found["power"]["quantity"] == "pulse"


def test_a_stored_reference_stands_for_the_healthy_recordings(leave, files, tmp_path, monkeypatch):
    """The answer is the same to the last digit, and nothing is simulated again. It holds no averages of the mate."""
    reference, point = tmp_path / "machine.npz", ("--torque", 356, "--format", "json")
    healthy = ("--healthy", files / "healthy.csv", "--save-reference", reference)
    code, out, _ = leave("diagnose", files / "sixth.csv", *TACHO, *point, *healthy)
    with monkeypatch.context() as patch:
        patch.setattr("sigdb.diagnosis.change.templates.Templates.simulated", None)
        again, stored, err = leave("diagnose", files / "sixth.csv", *TACHO, *point, "--healthy", reference)
    assert (again, err) == (code, "")
    found, direct = json.loads(stored), json.loads(out)
    assert "mate-not-compared" in {note["code"] for note in found["notes"]}
    for answer in (found, direct):
        answer["notes"] = [note for note in answer["notes"] if note["code"] != "mate-not-compared"]
    assert found == direct
    code, _, err = leave("diagnose", reference, *TACHO)
    assert (code, "is the reference of a machine, not a recording" in err) == (2, True)
    whole = bytearray(reference.read_bytes())
    whole[len(whole) // 2] ^= 1
    reference.write_bytes(whole)
    code, out, err = leave("diagnose", files / "sixth.csv", *TACHO, *point, "--healthy", reference)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "machine.npz: " in err


def test_a_recording_alone_is_stored_as_the_reference(leave, files, tmp_path):
    reading, reference = ("--sampling-rate", RATE, "--tacho", "tacho", "--format", "json"), tmp_path / "new.npz"
    teeth = ("--teeth", 12)
    code, out, err = leave("diagnose", files / "healthy.csv", *reading, *teeth, "--save-reference", reference)
    assert (code, err) == (json.loads(out)["exit_code"], "")
    _, whole, _ = leave("diagnose", files / "sixth.csv", *reading, *teeth, "--healthy", files / "healthy.csv")
    _, stored, _ = leave("diagnose", files / "sixth.csv", *reading, *teeth, "--healthy", reference)
    assert json.loads(stored) == json.loads(whole)
    code, _, err = leave("diagnose", files / "sixth.csv", *reading, "--teeth", 24, "--healthy", reference)
    assert (code, "differ in their tooth count" in err) in ((2, True), (3, False))


def test_recordings_that_are_too_large_are_diagnosed_in_blocks(leave, files, folder, monkeypatch):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures", "--format", "json")
    _, whole, _ = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_BYTES", 100_000)
    monkeypatch.setattr("sigdb.recording.files.formats.contents.BLOCK_VALUES", 20_000)
    with pytest.raises(InputError, match="in blocks"):
        sigdb.read_recording(files / "sixth.csv", sampling_rate=RATE)
    code, blocks, err = leave("diagnose", files / "sixth.csv", *TACHO, *options)
    assert (code, err) == (1, "")
    expected, found = json.loads(whole), json.loads(blocks)
    assert found["answer"] == expected["answer"]
    assert found["statistics"]["score"] == pytest.approx(expected["statistics"]["score"])


def test_without_a_tacho_teeth_are_counted_from_the_beginning(leave, files, folder):
    options = ("--healthy", files / "healthy.csv", "--db", folder / "signatures", "--mesh-phase", "--format", "json")
    code, out, err = leave("diagnose", files / "sixth.csv", *READ, *options)
    assert (code, err) == (1, "")
    found = json.loads(out)
    assert not found["absolute"]
    assert [note["code"] for note in found["missing"]] == ["no-tacho-mark", "speed-doubt", "speed-doubt"]
    assert found["missing"][2]["text"].startswith("A reliable speed in the healthy recording: ")


def test_without_a_healthy_recording_the_answer_is_whether_an_event_repeats(leave, files):
    code, out, err = leave("diagnose", files / "sixth.csv", *TACHO, "--format", "json")
    found = json.loads(out)
    assert (code, err) == (found["exit_code"], "")
    assert found["kind"] in ("one event", "nothing stands out", "cannot be judged")
    assert found["repeatability"]["revolutions"] == 102
    assert [note["code"] for note in found["missing"]] == ["no-healthy-recording"]


@pytest.mark.parametrize(("rate", "said"), [(RATE / 4, "0.251 times"), (RATE, None)])
def test_a_speed_far_from_the_rigs_asks_for_the_sampling_rate(leave, files, folder, monkeypatch, rate, said):
    """Templates that are made for the recording have its speed, so that they say nothing."""
    nothing = SimulatedTemplates(templates=None, assumed=(), machine="", speed_rpm=14400.0, torque=356.0)
    monkeypatch.setattr("sigdb.diagnosis.rig_templates.Source.templates", lambda self, **options: nothing)
    options = (*READ[:2], "--sampling-rate", rate, "--tacho", "tacho", "--format", "json")
    _, out, _ = leave("diagnose", files / "sixth.csv", "--healthy", files / "healthy.csv", *options)
    notes = [note["text"] for note in json.loads(out)["notes"] if note["code"] == "far-from-rig-speed"]
    assert len(notes) == (said is not None)
    if said:
        assert f"{said} the rig's operating speed of 14400 rpm" in notes[0]
        assert notes[0].endswith("check the sampling rate and the tacho.")


HEALTHY = ("--healthy", "{files}/healthy.csv")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["{files}/nothing.csv", *TACHO], "nothing.csv"),
        (["{files}/sixth.csv", *TACHO, "--rig", "nothing"], "no built-in rig 'nothing'"),
        (["{files}/sixth.csv", *TACHO, "--rig", "two-stage-gearbox"], "has 2 meshes"),
        (["{files}/sixth.csv", *TACHO, "--gear", "wheel"], "gear = 'wheel' is not a gear of nasa-spiral-bevel"),
        (
            ["{files}/sixth.csv", *TACHO, *HEALTHY, "--sensor", "wheel"],
            "sensor = 'wheel' is not a sensor of nasa-spiral",
        ),
        (["{files}/sixth.csv", *TACHO, "--db", "{db}", "--sensor", "wheel"], "wheel"),
        (["{files}/sixth.csv", *TACHO, "--channel", "a9"], "a9"),
        (["{files}/sixth.csv", *READ], "no channel is known as its tacho"),
        (["{files}/sixth.csv", *READ[2:], "--tacho", "tacho"], "neither a rig nor tooth counts are given"),
        (["{files}/sixth.csv", *TACHO, "--teeth", "12/36"], "rig and teeth are given together"),
        (["{files}/sixth.csv", *READ[2:], "--tacho", "tacho", "--teeth", "12", "--db", "{db}"], "without the rig"),
        (["{files}/sixth.csv", *READ[2:], "--tacho", "tacho", "--teeth", "12.5"], "12.5"),
        (["{files}/sixth.csv", *TACHO, *HEALTHY, "--healthy-torque", "1", "--healthy-torque", "2"], "2 values for 1"),
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


@pytest.mark.parametrize(("name", "which"), [("noise", "of this recording"), ("sixth", "of the healthy recording")])
def test_a_gear_that_is_not_there_is_not_judged(leave, files, name, which):
    healthy = files / ("healthy.csv" if name == "noise" else "noise.csv")
    code, out, err = leave("diagnose", files / f"{name}.csv", *TACHO, "--healthy", healthy)
    assert (code, err) == (3, "")
    assert out.startswith(f"Cannot be judged: no mesh of 12 teeth stands out {which}.\n")


def test_two_sources_of_the_angle_are_refused(leave, files):
    code, out, err = leave("diagnose", files / "sixth.csv", *TACHO, "--mesh-phase")
    assert (code, out) == (2, "")
    assert "Give either --tacho or --mesh-phase." in err


@pytest.fixture
def two_channels(files, tmp_path):
    """Files whose second channel is the first one inverted, with noise of its own."""
    for number, name in enumerate(("sixth", "healthy")):
        x, tacho = np.loadtxt(files / f"{name}.csv", delimiter=",", skiprows=1).T
        noise = 0.5 * x.std() * np.random.default_rng(number).standard_normal(x.size)
        columns = np.column_stack([x, noise - x, tacho])
        header = "pinion-vertical,a2,tacho"
        np.savetxt(tmp_path / f"{name}.csv", columns, delimiter=",", header=header, comments="", fmt="%.6g")
    return tmp_path


def test_two_channels_have_one_answer(leave, two_channels):
    reading = ("--sampling-rate", RATE, "--tacho", "tacho", "--teeth", 12)
    given = (two_channels / "sixth.csv", *reading, "--healthy", two_channels / "healthy.csv")
    channels = ("--channel", "pinion-vertical", "--channel", "a2")
    code, out, err = leave("diagnose", *given, *channels, "--out", two_channels / "page")
    assert code == 1
    assert out.startswith("One tooth stands out: ")
    assert "Probability of no damage " in out
    assert "log10 odds alone" in out
    assert err.startswith("page: ")
    page = (two_channels / "page" / "index.html").read_text(encoding="utf-8")
    assert out.splitlines()[0] in page
    assert (two_channels / "page" / "average-2" / "index.html").is_file()
    numbers = json.loads((two_channels / "page" / "diagnosis.json").read_text(encoding="utf-8"))
    assert 6 in numbers["candidates"]
    assert [part["channel"] for part in numbers["parts"]] == ["pinion-vertical", "a2"]
    code, out, err = leave("diagnose", *given, *channels, "--save-reference", two_channels / "machine.npz")
    assert (code, out) == (2, "")
    assert "A reference is of one channel" in err
