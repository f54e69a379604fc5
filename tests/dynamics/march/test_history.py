"""Unit and verification: raw histories: constant speed, run-ups, torque that changes and reverses, tacho, filter."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from sigdb.dynamics import TimeProfile, march, prepare_periodic, simulate
from sigdb.dynamics.march import history
from sigdb.transmission import Damage, Transmission, load_transmission, modal_system

REVOLUTION = 60 / 14400
# Flanks that overlap exactly add up to a constant stiffness.
EVEN = {"meshes.main.profile.contact_ratio": 1.25, "meshes.main.profile.flank": 0.25}
BACKLASH = 5e-5


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def even(rig):
    """With constant mesh stiffness and backlash."""
    data = rig.replace(EVEN).model_dump()
    data["meshes"]["main"]["backlash"] = BACKLASH
    return Transmission.model_validate(data)


def test_a_constant_speed_averages_to_the_periodic_signal(rig):
    """From its state at the mark, five revolutions at 12 x 17 samples each; below 0.35 of the sampling rate."""
    damage, n, N = Damage(tooth=4, stiffness_loss=0.3, phase_shift_deg=1.0), 12 * 17, 7
    prepared = prepare_periodic(rig)
    teeth = damage.on_teeth(12)
    steady = prepared.steady_state([teeth])[0]
    found = march(
        rig,
        damage,
        duration=N * REVOLUTION,
        sampling_rate=n / REVOLUTION,
        state=prepared.modal_state(teeth, np.zeros(12)),
        system=prepared.system,
    )
    assert_allclose(found.turns, np.arange(N * n) / n, rtol=1e-12)
    assert_allclose(found.time, np.arange(N * n) / n * REVOLUTION, rtol=1e-12)
    assert (found.speed_rpm == 14400).all()
    assert found.contact == 1
    below = np.arange(int(0.35 * n))
    for signal, expected in zip(found.signals.values(), steady.signals, strict=True):
        # The filter's ends hold what was before and behind.
        average = signal.reshape(N, n)[1:-1].mean(axis=0)
        orders = (np.fft.rfft(one)[below] / len(one) for one in (average, expected))
        assert_allclose(*orders, rtol=0, atol=1e-3 * np.ptp(expected))
    compression = steady.compression[:: steady.compression.size // 12]
    assert_allclose(found.compression["main"][n : 2 * n : 17], compression, rtol=0, atol=5e-3 * np.ptp(compression))


def test_a_history_goes_on_from_the_state_where_another_ended(rig):
    rate = 12 * 256 / REVOLUTION
    more = {"sampling_rate": rate, "steps_per_tooth": 1}
    whole = march(rig, Damage(tooth=2, stiffness_loss=0.4), duration=5 * REVOLUTION, **more)
    first = march(rig, Damage(tooth=2, stiffness_loss=0.4), duration=2 * REVOLUTION, **more)
    second = march(rig, Damage(tooth=2, stiffness_loss=0.4), duration=3 * REVOLUTION, state=first.state, **more)
    assert len(whole.time) == 5 * 12 * 256
    for sensor, signal in whole.signals.items():
        joined = np.concatenate([first.signals[sensor], second.signals[sensor]])
        assert_allclose(joined, signal, rtol=0, atol=1e-9 * np.ptp(signal))
    assert_allclose(second.state, whole.state, rtol=0, atol=1e-9 * np.abs(whole.state).max())


def test_the_state_at_the_end_does_not_depend_on_what_the_filter_looks_ahead(rig):
    plain = march(rig, duration=2 * REVOLUTION, sampling_rate=12 * 256 / REVOLUTION, steps_per_tooth=1)
    filtered = march(rig, duration=2 * REVOLUTION, sampling_rate=12 * 16 / REVOLUTION, steps_per_tooth=255)
    assert_allclose(filtered.state, plain.state, rtol=0, atol=1e-9 * np.abs(plain.state).max())


def test_chunks_change_nothing(rig, monkeypatch):
    """One chunk, and chunks of a few samples that end between those given out."""
    profile = TimeProfile([0.0, 0.01], [12000.0, 15000.0])
    settings = {
        "duration": 0.012,
        "sampling_rate": 20e3,
        "speed_rpm": profile,
        "torque": TimeProfile([0, 1], [300, 400]),
    }
    whole = march(rig, Damage(tooth=1, stiffness_loss=0.5), **settings)
    monkeypatch.setattr(history, "_CHUNK", 1000)
    parts = march(rig, Damage(tooth=1, stiffness_loss=0.5), **settings)
    for name in whole.signals:
        assert_allclose(parts.signals[name], whole.signals[name], rtol=0, atol=1e-12 * np.ptp(whole.signals[name]))
    for name in whole.mesh_force:
        assert_allclose(parts.mesh_force[name], whole.mesh_force[name], rtol=1e-12)
    assert_allclose(parts.state, whole.state, rtol=1e-12)
    assert parts.contact == whole.contact


def test_a_run_up_turns_as_its_speed_says_and_so_does_the_tacho(rig):
    """From 6000 to 18000 rpm in 0.1 s, then on: ``theta = n0 t + a t^2 / 2``, solved for the pulses."""
    n0, a, ends = 100.0, 2000.0, 0.1
    found = march(
        rig,
        duration=0.12,
        sampling_rate=50e3,
        speed_rpm=TimeProfile([0.0, ends], [60 * n0, 60 * (n0 + a * ends)]),
        tacho="gear-shaft",
        pulses_per_revolution=4,
    )
    t = found.time
    ramp = np.minimum(t, ends)
    turns = n0 * ramp + a * ramp**2 / 2 + (n0 + a * ends) * (t - ramp)
    assert_allclose(found.turns, turns, rtol=0, atol=1e-9)
    assert_allclose(found.speed_rpm, 60 * (n0 + a * ramp), rtol=1e-12)
    # A quarter turn of the gear's shaft is 3/4 of a turn of the pinion's.
    count = int(turns[-1] / 0.75) + 1
    assert len(found.pulse_times) == count
    wanted = 0.75 * np.arange(count)
    at_end = n0 * ends + a * ends**2 / 2
    expected = np.where(
        wanted < at_end,
        (np.sqrt(n0**2 + 2 * a * wanted) - n0) / a,
        ends + (wanted - at_end) / (n0 + a * ends),
    )
    assert_allclose(found.pulse_times, expected, rtol=1e-12, atol=1e-15)


def test_the_mesh_frequency_follows_the_speed(rig):
    """Over the angle the mesh order stays the strongest line of the compression; over time it moves."""
    found = march(rig, duration=0.2, sampling_rate=40e3, speed_rpm=TimeProfile([0.0, 0.2], [7000.0, 9000.0]))
    compression = found.compression["main"]
    angle = np.arange(2 * 768, 22 * 768) / 768
    even = np.interp(angle, found.turns, compression)
    assert np.abs(np.fft.rfft(even - even.mean())).argmax() == 20 * 12
    for start, stop in ((0.02, 0.05), (0.15, 0.18)):
        part = slice(int(start * 40e3), int(stop * 40e3))
        spectrum = np.abs(np.fft.rfft((compression[part] - compression[part].mean()) * np.hanning(1200)))
        frequency = spectrum.argmax() * 40e3 / 1200
        assert frequency == pytest.approx(12 * found.speed_rpm[part].mean() / 60, abs=40e3 / 1200)


def test_unbalance_grows_with_the_square_of_the_speed_and_has_a_tangential_part(even):
    """``U (w^2 cos + w' sin, w^2 sin - w' cos)`` of each shaft, against DOP853 of the modal equations.

    The speed changes so fast that the tangential part counts; the mesh stays closed with constant stiffness, so that
    all is linear.
    """
    rig = even.replace({"pinion.unbalance": 2e-5, "gear.unbalance": 3e-4, "gear.unbalance_angle_deg": 50.0})
    duration, n0, slope = 0.01, 100.0, 3e4
    system = modal_system(rig)
    upper = system.poles.imag >= 0
    poles, weight = system.poles[upper], np.where(system.poles[upper].imag > 0, 2.0, 1.0)
    first = len(system.meshes) + 2

    def force(t):
        found = np.zeros(system.inputs.shape[1])
        for i, shaft in enumerate(system.unbalanced):
            ratio = 2 * np.pi * abs(rig.ratio(shaft))
            angle, w, dw = ratio * (n0 * t + slope * t**2 / 2), ratio * (n0 + slope * t), ratio * slope
            nominal = abs(rig.speed(shaft))
            found[first + 2 * i] = (w**2 * np.cos(angle) + dw * np.sin(angle)) / nominal**2
            found[first + 2 * i + 1] = (w**2 * np.sin(angle) - dw * np.cos(angle)) / nominal**2
        return found

    rate = 200e3
    t = np.arange(int(duration * rate)) / rate
    z = solve_ivp(
        lambda t, z: poles * z + system.inputs[upper] @ force(t),
        (0, t[-1]),
        np.zeros(len(poles), complex),
        method="RK45",
        t_eval=t,
        rtol=1e-6,
        atol=1e-12,
    ).y
    torque = system.inputs[upper, len(system.meshes)] / -poles
    expected = ((weight * system.outputs[:, upper]) @ (z + torque[:, None])).real
    expected += system.direct @ (np.array([force(one) for one in t]).T + np.eye(len(system.direct.T))[:, [1]])

    found = march(
        rig,
        duration=duration,
        sampling_rate=rate,
        speed_rpm=TimeProfile([0.0, duration], [60 * n0, 60 * (n0 + slope * duration)]),
        steps_per_tooth=8,
    )
    assert found.contact == 1
    rows = [found.compression["main"], *found.signals.values()]
    for one, wanted in zip(rows, expected, strict=True):
        assert_allclose(one[50:-50], wanted[50:-50], rtol=0, atol=2e-3 * np.ptp(wanted))


def test_compression_follows_a_torque_that_changes_slowly(even):
    """With constant stiffness ``delta = delta_s T / T_0``."""
    torque = TimeProfile([0.0, 0.4], [356.05, 178.0])
    found = march(even, duration=0.4, sampling_rate=10e3, torque=torque)
    static = prepare_periodic(even).static_compression[0]
    assert_allclose(found.torque, torque(found.time))
    assert_allclose(found.compression["main"][40:-40], (static * found.torque / 356.05)[40:-40], rtol=1e-3)


def test_at_rest_under_the_first_torque_nothing_moves(even):
    found = march(even, duration=0.02, sampling_rate=10e3, torque=200.0)
    static = prepare_periodic(even).static_compression[0] * 200 / 356.05
    assert_allclose(found.compression["main"], static, rtol=1e-9)
    assert_allclose(found.mesh_force["main"], 2.2e8 * static, rtol=1e-9)


def test_a_reversed_torque_crosses_the_backlash(even):
    """The mesh force changes sign; the compression changes by the two static ones and the backlash."""
    found = march(even, duration=0.3, sampling_rate=10e3, torque=TimeProfile([0.05, 0.1], [356.05, -356.05]))
    force, compression = found.mesh_force["main"], found.compression["main"]
    assert force[:500] == pytest.approx(force[0])
    assert force[-1] == pytest.approx(-force[0], rel=1e-3)
    assert (force == 0).any()
    before, after = compression[300], compression[-100]
    assert before == pytest.approx(356.05 / 356.05 * prepare_periodic(even).static_compression[0], rel=1e-6)
    assert after == pytest.approx(-before - BACKLASH, rel=1e-3)
    # Closed on the working flanks until the torque has turned, and never again.
    assert 0.05 / 0.3 < found.contact < 0.1 / 0.3
    assert (force[2000:] < 0).all()


def test_without_backlash_in_the_rig_the_backs_never_touch(rig):
    data = rig.model_dump()
    data["meshes"]["main"]["backlash"] = None
    del data["meshes"]["main"]["assumed"]["backlash"]
    rig = type(rig).model_validate(data)
    found = march(rig, duration=0.02, sampling_rate=20e3, torque=TimeProfile([0.0, 0.005], [356.05, -50.0]))
    assert found.mesh_force["main"][-1] == 0
    assert found.mesh_force["main"].min() == 0
    assert found.compression["main"][-100:].max() < -1e-3


@pytest.mark.parametrize("finer", [2, 5, 16])
@pytest.mark.parametrize(
    ("frequency", "least", "most"),
    [(0.0, 0.9998, 1.0002), (0.2, 0.9998, 1.0002), (0.38, 0.9998, 1.0002), (0.45, 0.4, 0.6)],
)
def test_the_filter_passes_what_the_rate_holds_without_delay(finer, frequency, least, most):
    samples = 400
    t = np.arange(samples * finer + 1) / finer
    sine = np.column_stack([np.cos(2 * np.pi * frequency * t), np.sin(2 * np.pi * frequency * t)])
    whole = history._AntiAlias(finer, sine[0])
    found = np.concatenate([whole(sine[1:700]), whole(sine[700:])])
    inner = slice(40, len(found) - 40)
    turned = (found @ [1, 1j]) * np.exp(-2j * np.pi * frequency * np.arange(len(found)))
    assert len(found) == samples + 1 - 32
    assert_allclose(turned[inner].imag, 0, atol=1e-9)
    assert least < turned[inner].real.min() <= turned[inner].real.max() < most


@pytest.mark.parametrize("finer", [2, 5, 16])
@pytest.mark.parametrize("frequency", [0.5, 0.6, 0.8, 0.97])
def test_the_filter_stops_what_would_fold_back(finer, frequency):
    t = np.arange(400 * finer + 1) / finer
    sine = np.cos(2 * np.pi * frequency * t + 0.3)[:, None]
    found = history._AntiAlias(finer, sine[0])(sine[1:])
    assert np.abs(found[40:-40]).max() < 2e-4


def test_a_line_above_the_rate_is_not_recorded(rig):
    """Twelve samples a revolution hold orders below 6; the mesh order 12 would fold to 0 and be steady."""
    found = march(
        rig,
        duration=60 * REVOLUTION,
        sampling_rate=13 / REVOLUTION,
        state=prepare_periodic(rig).modal_state({}, np.zeros(12)),
    )
    signal = found.signals["pinion-vertical"][40:-40]
    mesh = prepare_periodic(rig).steady_state([{}])[0].signals[0]
    assert np.ptp(signal) < 1e-3 * np.ptp(mesh)


@pytest.mark.parametrize("torque", [None, 200.0])
def test_a_run_up_that_is_settled_begins_with_the_periodic_motion(torque):
    """No transient at time 0: the first revolution is the steady state of the first speed and torque."""
    rig = load_transmission("nasa-spiral-bevel").replace({"pinion.unbalance": 2e-5})
    damage, rate = Damage(tooth=6, stiffness_loss=0.3), 64 * 12 * 240.0
    at = {"duration": 1 / 240, "sampling_rate": rate, "torque": torque}
    found, at_rest = march(rig, damage, settled=True, **at), march(rig, damage, **at)
    steady = simulate(rig if torque is None else rig.replace({"operating.torque": torque}), damage)
    sensor, middle = "pinion-vertical", slice(64, -64)
    expected, size = steady.signal(sensor)[middle], np.ptp(steady.signal(sensor))
    assert np.abs(found.signals[sensor][middle] - expected).max() < 0.01 * size
    assert np.abs(at_rest.signals[sensor][middle] - expected).max() > 0.1 * size


def test_a_settled_beginning_that_is_given_a_state_goes_on_from_it(rig):
    begun = march(rig, duration=0.01, sampling_rate=40e3)
    on = {"duration": 0.005, "sampling_rate": 40e3, "state": begun.state}
    assert_array_equal(march(rig, settled=True, **on).mesh_force["main"], march(rig, **on).mesh_force["main"])
