"""Verification: a gear is called present where it is, and in no noise, tone or other gear."""

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.recording import Channel, NoMeshError, Recording, recorded_history, recorded_signature
from sigdb.recording.evidence.presence import mesh_presence

FS, TEETH, N, M = 6400, 12, 12 * 16, 60
THETA = 2 * np.pi * np.arange(M * N) / N


def coloured(stream, samples, slope):
    """Noise of unit deviation whose power falls with a power of the frequency: 0 white, 1 pink, 2 brown."""
    X = np.fft.rfft(stream.standard_normal(samples))
    x = np.fft.irfft(X / np.maximum(np.arange(len(X)), 1) ** (slope / 2), samples)
    return x / x.std()


def gear(theta, teeth=TEETH, depth=0.3):
    """Three mesh harmonics, modulated once a revolution."""
    mesh = np.cos(teeth * theta) + 0.6 * np.cos(2 * teeth * theta + 1) + 0.4 * np.cos(3 * teeth * theta + 2)
    return (1 + depth * np.cos(theta - 1)) * mesh


def every_second(theta, teeth, share):
    """A gear whose mesh harmonics without a factor of two have a share of the amplitude of the others."""
    mesh = sum((1 if h % 2 == 0 else share) * np.cos(h * teeth * theta + h) for h in range(1, N // 2 // teeth))
    return (1 + 0.3 * np.cos(theta)) * mesh


def damaged(theta, seed, size):
    """A gear whose first tooth makes an event in each revolution, behind a path of many resonances."""
    stream = np.random.default_rng(seed)
    gains = np.exp(stream.standard_normal(N // 2 - 6) + 2j * np.pi * stream.uniform(size=N // 2 - 6))
    event = np.fft.irfft(np.concatenate([np.zeros(6), gains, [0.0]]), N)
    return gear(theta) + size * np.tile(event / event.std(), M)


def presence(x, teeth=TEETH, **options):
    return mesh_presence(x, samples_per_rev=N, teeth=teeth, highest=N / 2, **options)


@pytest.mark.parametrize("slope", [0, 1, 2])
def test_probabilities_of_noise_are_even_whatever_its_colour(slope):
    """A share a of all p is below a: within three deviations of a binomial law of 100 records."""
    stream = np.random.default_rng(slope)
    found = [presence(coloured(stream, M * N, slope)) for _ in range(100)]
    p = np.array([one.p_value for one in found])
    for share in (0.1, 0.5):
        assert abs(np.mean(p < share) - share) < 3.5 * np.sqrt(share * (1 - share) / 100)
    assert sum(one.present for one in found) <= 1  # 0.1 are expected
    # Sidebands too, though here three probabilities are taken together: they are larger than those of an even law.
    assert np.mean([one.p_revolution < 0.1 for one in found]) < 0.2


@pytest.mark.parametrize(("amplitude", "present"), [(1.0, True), (0.1, True), (0.003, False)])
def test_a_gear_is_present_down_to_its_noise(amplitude, present):
    """In the average of 60 revolutions of 192 samples, noise of 1 leaves 0.013 at an order: 0.1 is 18 dB above it."""
    noise = np.random.default_rng(1).standard_normal(M * N)
    found = presence(amplitude * gear(THETA) + noise)
    assert found.present == present
    assert found.kept_by_noise == pytest.approx(1 / np.sqrt(M))
    assert ("stands out: noise alone" in found.reason) == present


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_a_gear_with_a_badly_damaged_tooth_is_present(size):
    """The event has up to six times the power of the mesh, also at the orders of half as many teeth."""
    noise = 0.1 * np.random.default_rng(3).standard_normal(M * N)
    found = [presence(damaged(THETA, seed, size) + noise) for seed in range(30)]
    assert [one.reason for one in found if "teeth stand out more" in one.reason] == []


@pytest.mark.parametrize("phase", [False, True])
def test_a_clean_gear_is_present(phase):
    found = presence(gear(THETA), mesh_phase=phase)
    assert (found.present, found.spacing) == (True, 1)
    assert presence(every_second(THETA, 12, 0.2), mesh_phase=phase).present


def hum(theta, order):
    return sum(np.cos(order * k * theta + k**2) / k for k in range(1, 20))


@pytest.mark.parametrize(
    ("x", "teeth", "reason"),
    [
        (gear(THETA, 17), 12, "mesh orders of 17 teeth stand out more"),
        (gear(THETA, 12), 24, "stand out more"),
        (gear(THETA, 24), 12, "as of a gear of 24 teeth"),
        (gear(THETA, 30), 10, "as of a gear of 30 teeth"),
        (every_second(THETA, 12, 0.05), 12, "as of a gear of 24 teeth"),
        (every_second(THETA, 16, 0.35), 32, "stand out more"),
        (hum(THETA, 4), 12, "all lines are at multiples of order 4"),
        (hum(THETA, 2.37), 12, "from its mesh stand out more"),
        (np.random.default_rng(7).standard_normal(M * N), 12, "the average keeps what noise keeps"),
        (np.cos(12 * THETA) + 2 * np.cos(7.4 * THETA), 12, "tones between the orders of the shaft"),
        (10.0 * (np.arange(M * N) % N == 0), 12, "no higher than the orders about them"),
        (np.zeros(M * N), 12, "p = 1"),
        (gear(THETA), 120, "above the record's range"),
    ],
)
def test_what_is_no_such_gear_is_refused_with_its_reason(x, teeth, reason):
    """Gears of other tooth counts, hum in step with the shaft or not, a tone, cross-talk of a tacho, a dead channel."""
    noise = 1e-3 * np.random.default_rng(2).standard_normal(M * N) * bool(np.any(x))
    found = presence(x + noise, teeth)
    assert not found.present
    assert f"no mesh of {teeth} teeth stands out of this recording" in found.reason
    assert reason in found.reason


@pytest.mark.parametrize("twist", [0.03, 0.06])
@pytest.mark.parametrize("part", [2, 3])
def test_a_tacho_that_counts_parts_of_a_revolution_is_noticed(part, twist):
    """12 teeth by a tacho with two or three pulses read as one: a revolution of it holds a part of the teeth.

    The shaft twists twice a revolution, so that sidebands lie about the mesh as for a gear that is there.
    """
    theta = THETA / part
    x = gear(theta + twist * np.sin(2 * theta)) + 0.3 * np.random.default_rng(5).standard_normal(M * N)
    found = presence(x)
    assert not found.present
    assert "stand out more" in found.reason
    assert "pulses_per_rev and ratio" in found.reason


def test_orders_of_another_gear_on_the_shaft_are_no_rival():
    """A line of noise level at the mesh of 12 teeth, and the whole mesh of 29 teeth: refused unless 29 is known."""
    x = 0.01 * np.cos(12 * THETA) + gear(THETA, 29) + 0.05 * np.random.default_rng(3).standard_normal(M * N)
    assert "mesh orders of 29 teeth" not in presence(x, others=(29,)).reason
    assert presence(x).reason.count("stand out more")


def test_a_comb_without_sidebands_is_unverified_by_the_phase_of_the_mesh():
    x = gear(THETA, depth=0.0) + 0.1 * np.random.default_rng(4).standard_normal(M * N)
    found = presence(x, mesh_phase=True)
    assert (found.present, found.unverified, found.spacing) == (False, True, TEETH)
    assert "nothing repeats once a revolution" in found.reason
    assert presence(x).present


def record(kind, seed, seconds=4.0):
    stream, samples = np.random.default_rng(seed), int(seconds * FS)
    t = np.arange(samples) / FS
    white = stream.standard_normal(samples)
    return {
        "white": lambda: white,
        "pink": lambda: coloured(stream, samples, 1),
        "brown": lambda: coloured(stream, samples, 2),
        "adc": lambda: np.round(0.4 * white),
        "hum": lambda: hum(2 * np.pi * t, 50) + 0.05 * white,
        "tones": lambda: sum(np.cos(2 * np.pi * f * t) for f in stream.uniform(50, 1500, 6)) + 0.1 * white,
        "another machine": lambda: gear(2 * np.pi * 25 * t, 17) + 0.2 * white,
    }[kind]()


@pytest.mark.parametrize("kind", ["white", "pink", "brown", "adc", "hum", "tones", "another machine"])
@pytest.mark.parametrize("tacho", [True, False])
def test_no_indicators_of_a_recording_without_the_gear(kind, tacho):
    """19 teeth at about 1800 rpm are expected; a tacho turns at 29.3 Hz."""
    x = record(kind, 5)
    pulses = 1.0 * (29.3 * np.arange(x.size) / FS % 1 < 0.3)
    channels = [Channel(name=name, samples=one, sampling_rate=FS) for name, one in (("a1", x), ("tacho", pulses))]
    recording = Recording(source="run.csv", channels=tuple(channels[: 1 + tacho]), tacho="tacho" if tacho else None)
    options = {} if tacho else {"mesh_phase": True, "speed_range_rpm": (1440.0, 2160.0)}
    try:
        found = recorded_signature(recording, teeth=19, **options)
    except NoMeshError:  # the phase of the mesh is lost
        return
    assert not found.presence.present
    assert found.indicators == {}
    note = next(note for note in found.notes if note.code == "no-mesh")
    assert "noise alone would keep" in note.text
    with pytest.raises(InputError, match="no mesh of 19 teeth stands out"):
        found.row(torque=10.0)
    with pytest.raises(InputError, match="leave such recordings out of the history"):
        recorded_history([found])


@pytest.mark.parametrize("noise", [0.3, 1.0])
def test_an_oval_gear_is_present(noise):
    """Its strong lines are twice a revolution apart, and those of its single teeth may be below the noise."""
    oval = 1 + 0.3 * np.cos(2 * THETA + 1)
    x = sum(np.cos(12 * h * THETA + h) / h for h in (1, 2, 3)) * oval
    found = presence(x + noise * np.random.default_rng(4).standard_normal(M * N), 12)
    assert (found.present, found.spacing) == (True, 1)


@pytest.mark.parametrize("parts", [5, 7, 9])
def test_the_impacts_of_a_bearing_are_no_mesh_by_its_phase(parts):
    """Every fifth, seventh or ninth harmonic of the impacts passes for the mesh; a weak tone turns with the shaft."""
    x = sum(np.cos(12 / parts * j * THETA + j**2) for j in range(1, 4 * parts)) + 0.1 * np.cos(13 * THETA)
    found = presence(x + 0.3 * np.random.default_rng(4).standard_normal(M * N), 12, mesh_phase=True)
    assert not found.present
    assert not found.unverified


@pytest.mark.parametrize(
    ("asked", "present"), [(24, True), (12, False), (8, False), (6, False), (4, False), (48, False)]
)
def test_parts_and_multiples_of_the_tooth_count_are_not_present_where_each_tooth_differs(asked, present):
    """Errors of each tooth leave lines at all orders, so those of a part of the teeth too: they are no higher."""
    samples, teeth = 24 * 32, 24
    theta = 2 * np.pi * np.arange(40 * samples) / samples
    stream = np.random.default_rng(3)
    sizes = 1 + 0.4 * stream.standard_normal(teeth)
    x = gear(theta, teeth, depth=0.1) * sizes[(theta * teeth / (2 * np.pi)).astype(int) % teeth]
    x += 0.3 * stream.standard_normal(theta.size)
    found = mesh_presence(x, samples_per_rev=samples, teeth=asked, highest=samples / 2)
    assert found.present == present
