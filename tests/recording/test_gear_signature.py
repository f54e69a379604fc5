"""Unit and verification: signatures of recordings whose every component is known; what a database's row has."""

import json

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError, Note
from sigdb.pipeline import load_recipe
from sigdb.recording import SPEED_DOUBT, Channel, Recording, recorded_history, recorded_signature
from sigdb.recording.lines import record_spectrum, spectral_lines
from sigdb.recording.orders import averaged_gear
from sigdb.recording.speed import find_speed
from sigdb.signature import MeshPhase
from sigdb.sweep import run

FS = 6400.0
TEETH = 12


def turned(seconds, speed=20.0, rise=0.0, fs=FS):
    """Revolutions of a shaft whose speed rises evenly, rev/s and rev/s^2."""
    t = np.arange(int(seconds * fs)) / fs
    return speed * t + rise * t**2 / 2


def vibration(turns):
    """Mesh harmonics, modulated once a revolution, and a knock at tooth 6."""
    theta = 2 * np.pi * turns
    mesh = (1 + 0.3 * np.cos(theta - 1)) * (np.cos(12 * theta) + 0.6 * np.cos(24 * theta + 0.4))
    knock = np.exp(-((((turns % 1) - 5.5 / 12) * 24) ** 2)) * np.cos(30 * theta)
    return mesh + 0.5 * np.cos(36 * theta + 1) + 0.8 * knock


def tacho_of(turns, pulses_per_rev=1):
    """Rises through its middle at each mark: a triangle's steep side, sampled finely enough for its crossing."""
    phase = (turns * pulses_per_rev + 0.5) % 1 - 0.5
    return np.where(np.abs(phase) < 0.1, phase * 10, np.where(phase > 0, 1.0, -1.0))


def recording(turns, x, *, tacho=True, fs=FS, pulses_per_rev=1, **known):
    channels = [Channel(name="a1", samples=x, sampling_rate=fs, unit="m/s^2")]
    if tacho:
        samples = tacho_of(turns, pulses_per_rev)
        channels.append(Channel(name="tacho", samples=samples, sampling_rate=fs, unit="V"))
        known |= {"tacho": "tacho", "pulses_per_rev": pulses_per_rev}
    return Recording(source="made.csv", channels=tuple(channels), **known)


def one_revolution(n):
    return vibration(np.arange(n) / n)


def test_the_average_by_a_tacho_is_one_revolution_from_the_mark():
    turns = turned(8, 20.0, 0.1)
    found = recorded_signature(recording(turns, vibration(turns)), teeth=TEETH)
    # The first mark that the tacho rises through is at one revolution: at time 0 it is half way up already.
    np.testing.assert_allclose(found.tsa, one_revolution(768), atol=1e-3)
    assert (found.absolute, found.angle, found.unit, found.channel) == (True, "tacho tacho", "m/s^2", "a1")
    assert found.averages == int(turns[-1]) - 1
    assert found.dropped == 0
    assert found.kept == pytest.approx(1, abs=5e-3)
    # rev/s at times when the shaft has turned by 1 and by all revolutions
    start, stop = (np.sqrt(20**2 + 2 * 0.1 * r) for r in (1, found.averages + 1))
    assert found.speed_rpm == pytest.approx(60 * (start + stop) / 2, rel=1e-5)
    track = found.speed_track
    np.testing.assert_allclose(track["speed_rpm"], 60 * (20 + 0.1 * track["time"]), rtol=1e-4)


def test_the_average_by_the_mesh_is_the_same_revolution_turned():
    turns = turned(8, 20.0, 0.1)
    noise = np.random.default_rng(0).normal(size=turns.size)
    found = recorded_signature(recording(turns, vibration(turns) + noise, tacho=False), teeth=TEETH, mesh_phase=True)
    clean = one_revolution(768)
    overlap = np.fft.irfft(np.fft.rfft(found.tsa) * np.fft.rfft(clean).conj())
    assert overlap.max() > 0.99 * np.sqrt(np.sum(found.tsa**2) * np.sum(clean**2))
    assert not found.absolute
    notes = {note.code: note for note in found.notes}
    assert "tooth numbers are relative" in notes["relative-teeth"].text
    assert "between 300 and 6000 rpm" in notes["speed-from-spectrum"].text
    assert found.speed_rpm == pytest.approx(60 * (20 + 0.1 * 4), rel=2e-3)
    assert found.scatter == pytest.approx(1, rel=0.1)


def test_a_stated_speed_that_is_constant_gives_the_same_revolution():
    """No tacho, no search: the average by a tacho, begun at the first sample."""
    turns = turned(6)
    by_speed = recorded_signature(
        recording(turns, vibration(turns), tacho=False), teeth=TEETH, constant_speed=True, speed_rpm=1200.0
    )
    by_tacho = recorded_signature(recording(turns, vibration(turns)), teeth=TEETH)
    assert (by_speed.absolute, by_speed.speed_rpm) == (False, pytest.approx(1200.0))
    np.testing.assert_allclose(by_speed.tsa, by_tacho.tsa, atol=0.02)
    assert "constant-speed" in [note.code for note in by_speed.notes]


@pytest.mark.parametrize(
    ("options", "message"),
    [({}, "no speed is stated; give speed_rpm"), ({"mesh_phase": True, "speed_rpm": 1200.0}, "are both set")],
)
def test_a_constant_speed_needs_a_speed_and_nothing_else(options, message):
    turns = turned(2)
    with pytest.raises(InputError, match=message):
        recorded_signature(recording(turns, vibration(turns), tacho=False), teeth=TEETH, constant_speed=True, **options)


def test_a_tacho_on_another_shaft_gives_relative_teeth():
    gear_turns = turned(8, 20.0) / 3
    x = vibration(3 * gear_turns)
    found = recorded_signature(recording(gear_turns, x, pulses_per_rev=2, ratio=3.0), teeth=TEETH)
    assert found.speed_rpm == pytest.approx(1200, rel=1e-6)
    assert not found.absolute
    thrice = recorded_signature(recording(gear_turns, x, ratio=3.0), teeth=TEETH)
    assert thrice.absolute
    np.testing.assert_allclose(thrice.tsa, one_revolution(768), atol=5e-3)


def test_the_angle_is_that_of_the_cleanest_mesh_harmonic():
    turns = turned(8, 20.0)
    beside = 0.8 * np.cos(2 * np.pi * 12.3 * turns) + 0.4 * np.cos(2 * np.pi * 24.4 * turns)  # bends two harmonics
    noise = 0.1 * np.random.default_rng(8).normal(size=turns.size)
    x = vibration(turns) + beside + noise
    found, worse = (
        recorded_signature(recording(turns, x, tacho=False), teeth=TEETH, mesh_phase=True, harmonic=one)
        for one in (None, 1)
    )
    assert found.angle == "phase of mesh harmonic 3 of a1"
    assert found.kept > worse.kept
    assert found.speed_track["speed_rpm"].std() < 0.3 * worse.speed_track["speed_rpm"].std()


@pytest.mark.parametrize(("speed", "rise"), [(9.0, 0.0), (29.7, 0.0), (20.0, 0.25), (60.0, -1.0)])
def test_a_speed_is_found_in_noise_and_followed(speed, rise):
    turns = turned(8, speed, rise)
    x = vibration(turns) + 2 * np.random.default_rng(1).normal(size=turns.size)
    found = find_speed(x[None], FS, teeth=TEETH, range_rpm=(300, 6000))
    np.testing.assert_allclose(found.speed_rpm, 60 * (speed + rise * found.time), rtol=5e-3)


def test_all_channels_vote_for_the_speed():
    t = np.arange(80_000) / FS
    misled = sum(np.cos(2 * np.pi * 20 * (12 * h - 1) * t) for h in (1, 2, 3))  # only lower sidebands
    fair = vibration(20 * t)
    noise = 0.3 * np.random.default_rng(2).normal(size=(2, t.size))
    found = find_speed(np.stack([misled, fair]) + noise, FS, teeth=TEETH, range_rpm=(600, 2400))
    np.testing.assert_allclose(found.speed_rpm, 1200, rtol=2e-3)


def test_another_speed_that_explains_as_much_is_told():
    t = np.arange(80_000) / FS
    two = vibration(20 * t) + vibration(31 * t)  # two such shafts
    both = two + 0.1 * np.random.default_rng(3).normal(size=t.size)
    found = recorded_signature(recording(t, both, tacho=False), teeth=TEETH, mesh_phase=True)
    assert "not certain" in {note.code: note.text for note in found.notes}[SPEED_DOUBT]
    for given, rpm in (({"speed_rpm": 1870.0}, 1860), ({"speed_range_rpm": (1000.0, 1400.0)}, 1200)):
        near = recorded_signature(recording(t, both, tacho=False), teeth=TEETH, mesh_phase=True, **given)
        assert near.speed_rpm == pytest.approx(rpm, rel=1e-3)
        assert SPEED_DOUBT not in {note.code for note in near.notes}


def test_orders_of_a_rig_are_those_of_its_tooth_counts():
    found = averaged_gear(None, sigdb.load_transmission("two-stage-gearbox"), "input-pinion")
    orders = {one.name: one.order for one in found.orders}
    assert (found.teeth, found.shaft, found.cycle, found.speed_rpm) == (32, "input-shaft", 5, 1800)
    wanted = {
        "shaft middle-shaft": 32 / 80,
        "shaft output-shaft": 32 / 80 * 48 / 64,
        "mesh first x2": 64,
        "mesh first - middle-shaft": 31.6,
        "mesh first + input-shaft": 33,
        "mesh second": 32 / 80 * 48,
        "mesh second x3 + 2 output-shaft": 3 * 19.2 + 0.6,
    }
    for name, order in wanted.items():
        assert orders[name] == pytest.approx(order), name
    assert sorted(orders.values()) == list(orders.values())


def test_a_hunting_pair_is_averaged_over_whole_tooth_cycles():
    rig = sigdb.load_transmission("spur-test-rig")  # 19 and 48 teeth: no common factor
    turns = turned(6, 20.0)
    found = recorded_signature(recording(turns, vibration(turns)), rig=rig, gear="pinion", revolutions=None)
    assert (found.cycle, found.averages, found.dropped) == (48, 96, 118 - 96)
    assert "2 tooth cycles of 48" in {note.code: note.text for note in found.notes}["whole-tooth-cycles"]
    short = recorded_signature(recording(turns[:9600], vibration(turns[:9600])), rig=rig, gear="pinion")
    assert short.averages < 48
    assert "no whole number of tooth cycles" in {note.code: note.text for note in short.notes}["broken-tooth-cycles"]


def test_lines_of_other_shafts_are_found_and_named_with_a_rig():
    rig, turns = sigdb.load_transmission("two-stage-gearbox"), turned(8, 29.7)
    theta = 2 * np.pi * turns
    x = (1 + 0.2 * np.cos(0.4 * theta)) * np.cos(32 * theta) + 0.1 * np.cos(19.2 * theta) + 0.1 * np.cos(7.77 * theta)
    noise = 0.2 * np.random.default_rng(4).normal(size=turns.size)
    found = recorded_signature(recording(turns, x + noise), rig=rig, gear="input-pinion").lines.set_index("name")
    error = 5 * 0.2 * np.sqrt(6 / turns.size)  # five deviations of an amplitude behind a Hann window
    for name, amplitude in {
        "mesh first": 1.0,
        "mesh first - middle-shaft": 0.1,
        "mesh first + middle-shaft": 0.1,
        "mesh second": 0.1,
        "order 7.77": 0.1,
    }.items():
        assert found.loc[name, "amplitude"] == pytest.approx(amplitude, abs=error + 2e-3), name
        assert found.loc[name, "stands_out"], name
    assert found["stands_out"].sum() == 5
    without = recorded_signature(recording(turns, x + noise), teeth=32).lines.set_index("name")
    assert set(without.index[without["stands_out"]]) == {
        "mesh",
        "mesh -0.40",
        "mesh +0.40",
        "order 7.77",
        "order 19.20",
    }


def test_noise_alone_has_no_lines():
    known = averaged_gear(None, sigdb.load_transmission("two-stage-gearbox"), "input-pinion")
    stream = np.random.default_rng(5)
    count = named = 0
    for _ in range(20):
        spectrum = record_spectrum(stream.normal(size=150 * 512), samples_per_rev=512, highest=140.0)
        lines = spectral_lines(spectrum, known.orders, teeth=32)
        count, named = count + int(lines["stands_out"].sum()), named + len(lines)
    # One in 10 000 named orders, and one in 10 000 spectra, by construction.
    assert named > 1500
    assert count <= 3


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "recipe.toml").write_text(
        """
[sweep]
rig = "nasa-spiral-bevel"
seed = 6
specimens = 1
healthy = 2

[[sweep.grid]]
tooth = 6
stiffness_loss = 0.5

[measurement]
averages = 30
snr_db = -5.0

[signature]
sensors = ["pinion-vertical"]
""",
        encoding="utf-8",
    )
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "signatures")


def of_revolutions(revolutions, unit=1.0):
    """A recording of whole revolutions (M, n), each from its mark on, sampled in step with the shaft at 10 rev/s."""
    n = revolutions.shape[1]
    x = np.concatenate([revolutions.ravel(), revolutions[0, :1]]) * unit
    tacho = np.where(np.arange(x.size) % n < n // 2, 1.0, -1.0)
    tacho[::n] = 0.0  # the crossing is at the sample
    # A revolution before the first mark, so that it too is risen through.
    x, tacho = np.concatenate([revolutions[-1], x]), np.concatenate([-np.ones(n), tacho])
    channels = [Channel(name=name, samples=one, sampling_rate=10.0 * n) for name, one in (("a", x), ("tacho", tacho))]
    return Recording(source="made", channels=tuple(channels), tacho="tacho")


def test_a_row_of_a_recording_is_a_row_of_the_database(database):
    """The same average gives the same numbers: they are defined alike."""
    rows = database.features()
    tsa = database.signals(rows.index.to_numpy())["tsa"]
    for average, (_, row) in zip(tsa, rows.iterrows(), strict=True):
        x = average.astype(float)
        found = recorded_signature(of_revolutions(np.tile(x, (30, 1))), teeth=int(row["teeth"]))
        np.testing.assert_allclose(found.tsa, x, rtol=1e-9, atol=1e-9 * np.abs(x).max())
        made = found.row(torque=row["torque"], speed_rpm=row["speed_rpm"]).iloc[0]
        for name in ("teeth", "speed_rpm", "torque", "averages"):
            assert made[name] == row[name]
        assert made["fm4"] == pytest.approx(row["fm4"], rel=1e-5)
        cells = np.asarray(row["wigner_ville"])
        np.testing.assert_allclose(made["wigner_ville"], cells, atol=1e-5 * np.abs(cells).max())
        for name, value in found.indicators.items():
            assert value == pytest.approx(row[name], rel=1e-4), name
        np.testing.assert_allclose(
            found.order_spectrum["amplitude"], database.signals([row.name])["spectrum"][0], atol=1e-5 * np.abs(x).max()
        )


def test_a_recording_by_the_law_of_a_row_scatters_like_it(database):
    """White noise of the row's deviation between revolutions: scatter and average follow the database's law."""
    row = database.features().iloc[-1]
    M, n = int(row["averages"]), 64 * int(row["teeth"])
    clean = database.signals([row.name])["tsa"][0].astype(float)
    deviation = row["scatter"]
    revolutions = clean + deviation * np.random.default_rng(7).normal(size=(M, n))
    found = recorded_signature(of_revolutions(revolutions), teeth=int(row["teeth"]))
    # chi-square of n (M - 1) degrees of freedom, five deviations
    assert found.scatter == pytest.approx(deviation, rel=5 / np.sqrt(2 * n * (M - 1)))
    error = (found.tsa - clean) * np.sqrt(M) / deviation
    assert np.sum(error**2) == pytest.approx(n, abs=5 * np.sqrt(2 * n))


def test_a_history_is_na4_of_the_residuals():
    turns = turned(4, 20.0)
    x = vibration(turns)
    first, second = (recorded_signature(recording(turns, level * x), teeth=TEETH) for level in (1, 2))
    table = recorded_history([first, second], baseline=1)
    # Twice the level: the fourth moment is 16 times, the mean second moment (1 + 4) / 2 times, the first's 1.
    for name in ("na4", "nb4"):
        assert table[name][1] == pytest.approx(table[name][0] * 16 / 2.5**2, rel=1e-9)
        assert table[f"{name}_star"][1] == pytest.approx(table[name][0] * 16, rel=1e-9)
    r = np.fft.rfft(first.tsa)
    r[[0, 1, 2, *range(12, 384, 12)]] = 0
    r = np.fft.irfft(r)
    assert table["na4"][0] == pytest.approx(np.mean(r**4) / np.mean(r**2) ** 2, rel=1e-9)
    other = recorded_signature(recording(turns, x), teeth=24)
    with pytest.raises(InputError, match="differ in their tooth count: 12 in made"):
        recorded_history([first, other])


def test_all_of_a_signature_is_plain_json():
    turns = turned(2, 20.0)
    gaps = Note(code="filled-gaps", text="2 gaps were filled", values={"gaps": 2})
    found = recorded_signature(recording(turns, vibration(turns), notes=(gaps,)), teeth=TEETH)
    plain = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert plain["notes"][0] == {"code": "filled-gaps", "text": "2 gaps were filled", "values": {"gaps": 2}}
    assert plain["lines"]["order"] == found.lines["order"].tolist()
    assert len(plain["tsa"]) == 768
    assert any("reaches to order 160.0, 13.3 mesh orders" in note["text"] for note in plain["notes"])


def test_a_single_revolution_has_no_scatter():
    turns = turned(0.12, 20.0)
    found = recorded_signature(recording(turns, vibration(turns)), teeth=TEETH)
    assert found.averages == 1
    assert found.as_json()["scatter"] is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "teeth is missing"),
        ({"teeth": 12, "gear": "pinion"}, "no rig is given"),
        ({"teeth": 12, "channel": "b"}, "no channel 'b'"),
        ({"teeth": 12, "revolutions": 1000}, "revolutions = 1000 must be at most"),
        ({"teeth": 12, "mesh_phase": True, "speed_range_rpm": (2000.0, 1000.0)}, "must rise from above 0"),
        ({"teeth": 12, "mesh_phase": True, "speed_range_rpm": (20.0, 1000.0)}, "too short to find a speed"),
        ({"teeth": 13, "rig": "two-stage-gearbox"}, "has 0 gears with 13 teeth"),
        ({"rig": "two-stage-gearbox"}, "has 4 gears; name the gear"),
        ({"rig": "two-stage-gearbox", "gear": "input-pinion", "teeth": 12}, "has 32 teeth, not 12"),
        ({"rig": "two-stage-gearbox", "gear": "pinion"}, "gear"),
    ],
)
def test_what_is_missing_or_contradicts_is_told(options, message):
    turns = turned(4, 20.0)
    if "rig" in options:
        options = options | {"rig": sigdb.load_transmission(options["rig"])}
    with pytest.raises(InputError, match=message):
        recorded_signature(recording(turns, vibration(turns)), **options)


def test_a_recording_without_a_tacho_says_what_to_do():
    turns = turned(4, 20.0)
    with pytest.raises(InputError, match=r"no channel is known as its tacho; name it, or take .*mesh_phase"):
        recorded_signature(recording(turns, vibration(turns), tacho=False), teeth=TEETH)
    with pytest.raises(InputError, match="bound no revolution of 1"):
        recorded_signature(recording(0 * turns, vibration(turns)), teeth=TEETH)
    with pytest.raises(InputError, match="must be a whole number"):
        recorded_signature(recording(turns, vibration(turns), pulses_per_rev=1.5), teeth=TEETH)


def test_a_record_without_vibration_has_no_speed_and_no_lines():
    turns = turned(5, 20.0)
    with pytest.raises(InputError, match="nothing stands out"):
        recorded_signature(recording(turns, 0 * turns, tacho=False), teeth=TEETH, mesh_phase=True)
    found = recorded_signature(recording(turns, 0 * turns + 1.5), teeth=TEETH)
    assert (found.kept, found.lines["stands_out"].sum()) == (0, 0)
    assert (found.presence.present, found.indicators) == (False, {})


def test_a_harmonic_that_does_not_apply_is_skipped_and_a_wrong_input_is_not(monkeypatch):
    """Two harmonics lie above half the sampling rate; any other error of a user's input stops the search."""
    turns = turned(8, 20.0, fs=600.0)
    noise = 0.1 * np.random.default_rng(9).normal(size=turns.size)
    slow = recording(turns, np.cos(2 * np.pi * 12 * turns) + noise, tacho=False, fs=600.0)
    options = {"teeth": TEETH, "mesh_phase": True, "speed_rpm": 1200.0}
    assert recorded_signature(slow, **options).angle == "phase of mesh harmonic 1 of a1"

    pulses = MeshPhase.pulses

    def refuse_second(phase, harmonic):
        if harmonic == 2:
            raise InputError("x holds text")
        return pulses(phase, harmonic)

    monkeypatch.setattr(MeshPhase, "pulses", refuse_second)
    with pytest.raises(InputError, match="x holds text"):
        recorded_signature(slow, **options)


def test_a_run_up_has_an_order_map_and_a_steady_speed_has_none():
    turns = turned(12, 10.0, 1.0)
    signature = recorded_signature(recording(turns, vibration(turns)), teeth=TEETH)
    assert signature.order_map.speed_rpm[[0, -1]] == pytest.approx([600, 1320], rel=0.1)
    assert np.nanmedian(signature.order_map.along(24)) == pytest.approx(0.6, rel=0.1)
    assert signature.as_json()["order_map"]["amplitude"].keys() == {"mesh x1", "mesh x2", "mesh x3"}
    assert signature.envelope.band[1] <= FS / 2 / 22 * 1.01  # the fastest revolution has the lowest Nyquist order
    turns = turned(8)
    signature = recorded_signature(recording(turns, vibration(turns)), teeth=TEETH)
    assert signature.order_map is None
    assert list(signature.intervals["indicator"]) == list(signature.indicators)


def test_a_stated_band_of_the_envelope_is_taken():
    turns = turned(8)
    signature = recorded_signature(recording(turns, vibration(turns)), teeth=TEETH, envelope_band=(20, 60))
    assert (signature.envelope.band, signature.envelope.chosen) == ((20.0, 60.0), "stated")
    with pytest.raises(InputError, match="envelope_band = 60 to 20 orders must rise"):
        recorded_signature(recording(turns, vibration(turns)), teeth=TEETH, envelope_band=(60, 20))


def test_a_constant_channel_is_not_averaged_by_default(tmp_path):
    turns = turned(8)
    lines = [f"1500,{x:.5f},{y:.3f}" for x, y in zip(vibration(turns), tacho_of(turns), strict=True)]
    (tmp_path / "run.csv").write_text("\n".join(["rpm,a1,tacho", *lines]), encoding="utf-8")
    read = sigdb.read_recording(tmp_path / "run.csv", sampling_rate=FS, tacho="tacho")
    assert recorded_signature(read, teeth=TEETH).channel == "a1"
