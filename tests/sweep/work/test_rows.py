"""Verification: a stored row is what a direct simulation at the damaged tooth, the specimen's errors and noise give."""

import gc
import weakref

import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.core.streams import NOISE_BLOCK, noise_stream, specimen_stream
from sigdb.database import read_schema
from sigdb.dynamics import Periodic, Transient
from sigdb.measurement import index_errors
from sigdb.signature import indicators, mesh_bands, order_spectrum, pooled_wigner_ville
from sigdb.sweep.work.rows import make_rows

SENSORS = ("pinion-vertical", "pinion-housing-vertical")
STEP = 32
SOLVER = Periodic(samples_per_tooth=STEP)
MARCH = Transient(samples_per_tooth=STEP, steps_per_tooth=8 * STEP)
BOTH = ({"stiffness_loss": 0.4, "loss_extent": 0.2}, {}, {"phase_shift_deg": 1.0})


def suffix(sensor):
    return "" if sensor == SENSORS[0] else f"__{sensor}"


@pytest.fixture(scope="module")
def rows(small):
    return small.cases().set_index("id", drop=False)


@pytest.fixture(scope="module")
def signals(small):
    """``tsa`` and ``spectrum`` of each row by sensor; None where there is none."""
    table = pq.read_table(small.store.folder / "signals" / "part-00000.parquet").to_pydict()
    return {name: [None if one is None else np.float32(one) for one in table[name]] for name in table if name != "id"}


@pytest.fixture(scope="module")
def noise(rows, small_plan):
    """White noise of unit deviation, an average's, and its scatter, by row, whether stored or not.

    Of each block's stream, tooth count by tooth count: first the noise of its rows in order, then their scatters.
    """
    found = {}
    for first in range(0, len(rows), NOISE_BLOCK):
        stream = noise_stream(3, small_plan.hash, first // NOISE_BLOCK)
        for teeth, block in rows.loc[first : first + NOISE_BLOCK - 1].groupby("teeth"):
            n = teeth * STEP
            white = [stream.standard_normal((2, n)) for _ in block.index]
            for i, one, averages in zip(block.index, white, block["averages"], strict=True):
                freedom = n * (averages - 1)
                found[i] = one / np.sqrt(averages), np.sqrt(stream.chisquare(freedom, 2) / freedom)
    return found


def rig_of(row):
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    return rig.replace({"pinion.teeth": int(row.teeth), "operating.torque": row.torque})


def damage_of(row):
    if row.tooth == 0:
        return None
    if row.pattern:
        return sigdb.Damage(tooth=int(row.tooth), pattern=row.pattern, each=BOTH)
    return sigdb.Damage(
        tooth=int(row.tooth),
        damaged_teeth=int(row.damaged_teeth),
        phase_shift_deg=row.phase_shift_deg,
        stiffness_loss=row.stiffness_loss,
        loss_extent=row.loss_extent,
    )


@pytest.fixture(scope="module")
def reference_deviation():
    """Standard deviation of the healthy clean average by operating point, tooth count and sensor."""
    known = {}

    def of(row, sensor):
        key = row.teeth, row.torque
        if key not in known:
            healthy = sigdb.simulate(rig_of(row), solver=SOLVER)
            known[key] = {name: signal.std() for name, signal in healthy.signals.items()}
        return known[key][sensor]

    return of


def some_of_each(rows):
    """A row of each template, with different teeth, specimens, draws and measurements."""
    finished = rows[rows["status"] == "ok"]
    groups = finished.groupby("template")
    return [group.iloc[(7 * i + 3) % len(group)] for i, (_, group) in enumerate(groups)]


def test_a_row_is_the_simulation_at_its_tooth_with_its_specimen_and_noise(rows, signals, noise, reference_deviation):
    """Rows are ``roll(y_D + Y_D roll(e, -(t-1)), (t-1) n / teeth)``, against a simulation without turning."""
    chosen = some_of_each(rows)
    assert {(row.teeth, row.torque, bool(row.pattern)) for row in chosen} == {
        (12, 356.05, False),
        (12, 356.05, True),
        (12, 300.0, False),
        (12, 100.0, False),
        (13, 356.05, False),
    }
    for row in chosen:
        assert row.contact_loss == (row.torque == 100.0 and row.tooth > 0)
        if row.contact_loss:
            continue
        errors = row.index_error * index_errors(specimen_stream(3, row.specimen), row.teeth, 36)
        response = sigdb.simulate(rig_of(row), damage_of(row), index_errors=errors, solver=SOLVER)
        white, scatter = noise[row.id]
        for i, sensor in enumerate(SENSORS):
            deviation = reference_deviation(row, sensor) * 10 ** (-row.snr_db / 20)
            expected = response.signal(sensor) + deviation * white[i]
            stored = signals["tsa" + suffix(sensor)][row.id]
            # Templates and rows are stored as float32, each rounded by at most 6e-8 of the peak.
            assert_allclose(stored, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
            assert_allclose(row["scatter" + suffix(sensor)], deviation * scatter[i], rtol=1e-6)
        assert_allclose(row.min_compression, response.min_compression, rtol=0, atol=2e-6)
    row = next(row for row in chosen if row.index_error and not row.contact_loss)
    nominal = sigdb.simulate(rig_of(row), damage_of(row), solver=SOLVER)
    assert abs(row.min_compression - nominal.min_compression) > 1e-4


def test_a_row_that_loses_contact_is_the_march_at_its_tooth_with_noise_only(rows, signals, noise, reference_deviation):
    """Its specimen has no index errors in it. Both motions repeat to 1e-4 of their size, and say their own error."""
    lost = rows[rows["contact_loss"].astype(bool)]
    assert len(lost) == 3 * 2
    assert set(lost["status"]) == {"ok"}
    response = sigdb.simulate(rig_of(lost.iloc[0]), damage_of(lost.iloc[0]), solver=MARCH)
    assert set(lost["tooth"]) == {2}
    for row in lost.itertuples():
        white, scatter = noise[row.id]
        for i, sensor in enumerate(SENSORS):
            clean = response.signal(sensor)
            deviation = reference_deviation(row, sensor) * 10 ** (-row.snr_db / 20)
            stored = signals["tsa" + suffix(sensor)][row.id]
            assert_allclose(stored - deviation * white[i], clean, rtol=0, atol=(1e-4 + response.error) * np.ptp(clean))
            assert_allclose(lost.loc[row.id, "scatter" + suffix(sensor)], deviation * scatter[i], rtol=1e-6)
        assert_allclose(row.min_compression, response.min_compression, rtol=0, atol=1e-3)


def test_the_noise_is_what_the_snr_says(rows, signals, reference_deviation):
    """Differences of two draws of one case: variance 2 reference / 10^(snr/10) / averages; five standard errors."""
    for pattern, snr_db, averages in (("both", -10.0, 102), ("both", -10.0, 3), ("both", 20.0, 3), ("", 0.0, 102)):
        some = rows[(rows["pattern"] == pattern) & (rows["snr_db"] == snr_db) & (rows["averages"] == averages)]
        some = some[(some["status"] == "ok") & (some["teeth"] == 12) & (some["torque"] == 356.05) & (some["tooth"] > 0)]
        pairs = some.groupby(["template", "tooth", "specimen", "index_error"])["id"].apply(list)
        pairs = [pair for pair in pairs if len(pair) == 2]
        assert len(pairs) >= 12
        for sensor in SENSORS:
            tsa = signals["tsa" + suffix(sensor)]
            difference = np.array([np.subtract(tsa[a], tsa[b], dtype=float) for a, b in pairs])
            expected = 2 * reference_deviation(some.iloc[0], sensor) ** 2 / 10 ** (snr_db / 10) / averages
            assert_allclose((difference**2).mean(), expected, rtol=5 * np.sqrt(2 / difference.size))


def test_noise_differs_between_rows_and_sensors(rows, noise, signals, small_plan):
    for sensor in SENSORS:
        heard = {one.tobytes() for one in signals["tsa" + suffix(sensor)] if one is not None}
        assert len(heard) == (rows["status"] == "ok").sum()
    first, second = noise[0][0]
    assert abs(np.corrcoef(first, second)[0, 1]) < 5 / np.sqrt(len(first))


def test_a_specimen_is_shared_by_all_its_cases(rows, signals):
    """Averaged over noise draws, healthy rows of a specimen are closer to each other than to another specimen's."""
    healthy = rows[
        (rows["tooth"] == 0) & (rows["teeth"] == 12) & (rows["torque"] == 356.05) & (rows["averages"] == 102)
    ]
    healthy = healthy[(healthy["snr_db"] == 0.0) & (healthy["index_error"] == 2e-6)]
    mean = {
        specimen: np.mean([signals["tsa"][i] for i in some["id"]], axis=0)
        for specimen, some in healthy.groupby("specimen")
    }
    assert sorted(mean) == [0, 1, 2]
    clean = {
        specimen: sigdb.simulate(
            rig_of(healthy.iloc[0]),
            index_errors=2e-6 * index_errors(specimen_stream(3, specimen), 12, 36),
            solver=SOLVER,
        ).signal("pinion-vertical")
        for specimen in mean
    }
    distance = np.array([[np.std(mean[a] - clean[b]) for b in clean] for a in mean])
    assert (distance.argmin(axis=1) == [0, 1, 2]).all()


def test_healthy_rows_carry_no_tooth(rows):
    healthy = rows[rows["tooth"] == 0]
    assert set(healthy["damaged_teeth"]) == {0}
    assert (healthy[["phase_shift_deg", "stiffness_loss"]] == 0).all(axis=None)
    assert (rows.loc[rows["tooth"] > 0, "damaged_teeth"] > 0).all()
    # Of the paper's rig, three specimens at nine measurements; each other rig point has one measurement.
    assert len(healthy) == 3 * 20 * (1 + 8 + 1 + 1 + 1)


def test_the_table_of_the_plan_is_what_is_stored(rows, small_plan):
    """But that rows which lose contact say that no index errors are in them."""
    planned = small_plan.table(0, small_plan.rows)
    planned.loc[rows["contact_loss"].to_numpy(bool), "index_error"] = 0.0
    for name in planned:
        stored = rows[name].to_numpy()
        if planned[name].dtype.kind == "f":
            assert_allclose(stored.astype(float), planned[name], rtol=1e-15)
        else:
            assert stored.tolist() == planned[name].tolist(), name


@pytest.mark.parametrize("teeth", [12, 13])
def test_features_are_the_public_functions_of_the_stored_average(small, teeth, signals):
    rows = small.features(f"teeth = {teeth} and status = 'ok'")
    for sensor in SENSORS:
        tsa = np.array([signals["tsa" + suffix(sensor)][i] for i in rows["id"]])
        for name, values in indicators(tsa, teeth=teeth).items():
            stored = rows[name + suffix(sensor)].to_numpy()
            assert np.array_equal(stored, values.astype(np.float32), equal_nan=True), name
        # (tooth passes, bands a quarter mesh order wide), divided by n_bins n / teeth.
        n_bins = 6 * STEP
        cells = pooled_wigner_ville(tsa, teeth=teeth, bands=mesh_bands(teeth), lag_window=2 * STEP, n_bins=n_bins)
        expected = cells.reshape(len(rows), -1) / (n_bins * STEP)
        stored = np.stack(rows["wigner_ville" + suffix(sensor)].to_list())
        assert stored.shape == (len(rows), teeth * 17)
        assert_allclose(stored, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())


def test_the_spectrum_is_the_modulus_of_the_order_spectrum(rows, signals):
    for sensor in SENSORS:
        for i in rows.index[rows["status"] == "ok"][::5]:
            tsa = signals["tsa" + suffix(sensor)][i]
            stored = signals["spectrum" + suffix(sensor)][i]
            expected = np.abs(np.fft.rfft(tsa.astype(float))) * 2 / len(tsa)
            expected[[0, -1]] /= 2
            assert stored.dtype == np.float32
            assert_allclose(stored, expected, rtol=1e-6, atol=1e-7 * expected.max())
            assert_allclose(stored, np.abs(order_spectrum(tsa)[1]), rtol=1e-6, atol=1e-7 * expected.max())


def test_a_template_is_the_clean_simulation_at_tooth_1(small, reference_deviation):
    templates = small.templates()
    assert (templates["status"] == "ok").all()
    for number in templates.loc[~templates["contact_loss"].astype(bool), "template"]:
        case = templates.iloc[number].copy()
        assert case["template"] == number
        case["tooth"] = 1 if case["damaged_teeth"] else 0
        response = sigdb.simulate(rig_of(case), damage_of(case), solver=SOLVER)
        for sensor in SENSORS:
            signal = response.signal(sensor)
            assert_allclose(case["tsa" + suffix(sensor)], signal, rtol=0, atol=1e-7 * np.abs(signal).max())
            variance = case["reference_variance" + suffix(sensor)]
            assert_allclose(variance, reference_deviation(case, sensor) ** 2, rtol=1e-9)
        assert_allclose(case["compression"], response.compression, rtol=0, atol=1e-7 * response.compression.max())
        assert_allclose(case["min_compression"], response.min_compression, rtol=1e-6)
        assert case["floquet_multiplier"] < 1


def test_the_damaged_gear_may_be_the_driven_one(plan_of, tmp_path):
    """36 teeth against 12: the average is over the gear's revolution, and a tooth cycle is one revolution."""
    plan = plan_of(
        'gear = "gear"\nseed = 4\n[[sweep.grid]]\ntooth = [1, 30]\nstiffness_loss = 0.3\naverages = 1\nsnr_db = 300.0\n'
        '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical"]\n'
    )
    sigdb.sweep.run(plan, tmp_path, jobs=1)
    database = sigdb.open(tmp_path)
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    errors = 2e-6 * index_errors(specimen_stream(4, 0), 36, 12)
    for tsa, tooth in zip(database.signals([0, 1])["tsa"], (1, 30), strict=True):
        damage = sigdb.Damage(gear="gear", tooth=tooth, stiffness_loss=0.3)
        expected = sigdb.simulate(rig, damage, index_errors=errors, solver=SOLVER).signal("pinion-vertical")
        assert_allclose(tsa, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    cases = database.cases()
    assert set(cases["shaft"]) == {"gear-shaft"}
    # A single revolution has no scatter.
    assert cases["scatter"].isna().all()


def test_specimens_are_kept_no_longer_than_the_work_on_a_part(small, small_plan, monkeypatch):
    """They stayed in a cache of the process, 65 536 of them, whatever the sweep."""
    kept = []

    def drawn(stream, teeth, mate_teeth, **law):
        errors = index_errors(stream, teeth, mate_teeth, **law)
        kept.append(weakref.ref(errors))
        return errors

    monkeypatch.setattr("sigdb.sweep.work.averages.index_errors", drawn)
    store = small.store
    for _ in range(2):
        before = len(kept)
        assert len(list(make_rows(small_plan, store, read_schema(store), 0, NOISE_BLOCK))) == 1
        gc.collect()
        assert len(kept) > before
        assert [one for one in kept if one() is not None] == []
