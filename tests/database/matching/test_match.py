"""Unit: match, against brute force over all turns in double precision, and its cache."""

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.core.errors import DatabaseError, InputError
from sigdb.database.matching.index import cache_folder
from sigdb.database.matching.outside_threshold import COVERAGE_FILE, CoverageRecord, write_coverage

SECOND = "pinion-housing-vertical"
STEP = 32


def residual(x, teeth):
    """Of unit deviation, less its projections on the mean, orders 1 and 2, and mesh orders below Nyquist."""
    x = np.asarray(x, float)
    x = (x - x.mean()) / x.std()
    theta = 2 * np.pi * np.arange(x.size) / x.size
    for order in (1, 2, *range(teeth, (x.size + 1) // 2, teeth)):
        for wave in (np.cos(order * theta), np.sin(order * theta)):
            x = x - wave * (x @ wave) / (wave @ wave)
    return x


def brute_force(folder, x, teeth, *, column="tsa", turns=None):
    """Template, best turn in samples, match and residual distance, the nearest first."""
    z, found = residual(x, teeth), []
    for row in pq.read_table(folder / "templates" / "part-00000.parquet").to_pylist():
        if row["teeth"] != teeth or row["status"] != "ok":
            continue
        z_t = residual(row[column], teeth)
        shifts = range(len(x)) if turns is None else [int(one * STEP) for one in turns]
        distances = [np.sqrt(np.mean((z - np.roll(z_t, s)) ** 2)) for s in shifts]
        s = shifts[int(np.argmin(distances))]
        overlap = z @ np.roll(z_t, s) / np.sqrt((z @ z) * (z_t @ z_t)) if row["tooth"] else 0.0
        found.append((row["template"], s if row["tooth"] else 0, overlap, min(distances)))
    return sorted(found, key=lambda one: one[-1])


def check(match, expected):
    table = match.table
    assert sorted(table["template"]) == sorted(one[0] for one in expected)
    assert (np.diff(table["residual_distance"]) >= 0).all()
    by_template = {one[0]: one for one in expected}
    for row in table.itertuples():
        _, s, overlap, distance = by_template[row.template]
        assert row.turn == s / STEP
        assert_allclose([row.match, row.residual_distance], [overlap, distance], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("where", "teeth"), [("tooth = 6", 12), ("tooth = 0 and draw = 7", 12), ("tooth = 9", 11), ("tooth = 12", 12)]
)
def test_every_template_at_every_turn(database, folder, where, teeth):
    cases = database.cases(f"{where} and teeth = {teeth} and status = 'ok'")
    x = database.signals([cases["id"].iloc[-1]])["tsa"][0]
    check(database.match(x, k=100), brute_force(folder, x, teeth))


def test_a_turn_by_a_part_of_a_tooth(database, folder):
    x = np.roll(database.signals(database.cases("tooth = 6 and teeth = 12")["id"].iloc[:1])["tsa"][0], 11)
    check(database.match(x), brute_force(folder, x, 12))


def test_the_unit_of_the_average_does_not_matter(database):
    x = database.signals([400])["tsa"][0].astype(float)
    one, other = database.match(x), database.match(9.81e3 * x + 4)
    pd.testing.assert_frame_equal(one.table, other.table, rtol=1e-6)


def test_another_sensor(database, folder):
    x = database.signals([400], sensor=SECOND)["tsa"][0]
    check(database.match(x, sensor=SECOND), brute_force(folder, x, int(len(x) / STEP), column=f"tsa__{SECOND}"))


@pytest.mark.parametrize("turns", [range(12), [0], [3, 5.5], [-1]])
def test_given_turns(database, folder, turns):
    x = database.signals(database.cases("tooth = 6 and teeth = 12")["id"].iloc[-1:])["tsa"][0]
    expected = [(t, s % len(x), m, e) for t, s, m, e in brute_force(folder, x, 12, turns=turns)]
    table = database.match(x, turns=turns).table
    healthy = table["tooth"] == 0
    assert set(table["template"]) == {one[0] for one in expected}
    for row in table[~healthy].itertuples():
        (_, s, overlap, distance) = next(one for one in expected if one[0] == row.template)
        assert row.turn == s / STEP
        assert_allclose([row.match, row.residual_distance], [overlap, distance], rtol=0, atol=1e-6)


def test_a_clean_template_is_found_exactly_wherever_it_is_turned(database):
    templates = database.templates().set_index("template")
    damaged = templates[(templates["status"] == "ok") & (templates["tooth"] > 0)]
    for number, row in damaged.iterrows():
        for tooth in (1, 2, row["teeth"]):
            best = database.match(np.roll(row["tsa"], (tooth - row["tooth"]) * STEP), k=1).table.iloc[0]
            assert best["template"] == number
            assert best["tooth"] == tooth
            assert best["match"] == pytest.approx(1, abs=1e-6)
            assert best["residual_distance"] < 1e-6


def test_a_clean_healthy_average_fits_a_healthy_template_and_overlaps_with_nothing(database):
    healthy = database.templates().set_index("template").loc[0]
    table = database.match(healthy["tsa"]).table
    assert table["damaged_teeth"].iloc[0] == table["tooth"].iloc[0] == 0
    assert table["residual_distance"].iloc[0] == 0
    assert (table["match"] == 0).all()


def test_rows_are_found_again(database):
    """Little noise and few index errors: the nearest template is the row's own, at its tooth."""
    cases = database.cases("tooth > 0 and status = 'ok' and teeth = 12 and stiffness_loss = 0.4 and specimen = 0")
    assert len(cases) == 12
    for row, x in zip(cases.itertuples(), database.signals(cases["id"])["tsa"], strict=True):
        best = database.match(x, k=1, turns=range(12)).table.iloc[0]
        assert best["tooth"] == row.tooth
        assert best["stiffness_loss"] == row.stiffness_loss


def test_the_table(database):
    x = database.signals([400])["tsa"][0]
    table = database.match(x, k=3).table
    assert len(table) == 3
    assert list(table)[:6] == ["template", "tooth", "turn", "match", "residual_distance", "outside"]
    assert {"gear", "teeth", "speed_rpm", "torque", "damaged_teeth", "stiffness_loss", "pattern"} < set(table)
    templates = database.templates().set_index("template")
    for row in table.itertuples():
        assert row.stiffness_loss == templates.loc[row.template, "stiffness_loss"]
        assert row.torque == templates.loc[row.template, "torque"]


def test_where_chooses_templates(database):
    x = database.signals(database.cases("tooth = 6 and teeth = 12")["id"].iloc[:1])["tsa"][0]
    everything = database.match(x, k=100).table
    some = database.match(x, k=100, where="stiffness_loss < 0.3 and tooth > 0").table
    expected = everything[(everything["stiffness_loss"] < 0.3) & (everything["tooth"] > 0)].reset_index(drop=True)
    assert 0 < len(some) < len(everything)
    pd.testing.assert_frame_equal(some, expected)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"tsa": np.ones(384)}, r"tsa does not vary: there is no signal to compare"),
        ({"tsa": np.arange(100.0)}, r"tsa has 100 samples, .*: 352 \(11 teeth\), 384 \(12 teeth\), 32 samples a tooth"),
        ({"tsa": []}, r"tsa has 0 samples"),
        ({"tsa": np.zeros((2, 384))}, r"tsa has shape \(2, 384\); give one average"),
        ({"tsa": [0, np.nan, 1]}, r"tsa\[1\] is not a finite number"),
        ({"tsa": [0, np.inf, 1]}, r"tsa\[1\] is not a finite number"),
        ({"tsa": ["a"]}, r"tsa must be an array of real numbers"),
        ({"k": 0}, r"k = 0 must be 1 or more"),
        ({"sensor": "gear"}, r"sensor 'gear' is not stored in .*; stored: pinion-vertical"),
        ({"turns": [0, 0.3]}, r"turns: 0\.3 teeth is not a whole number of samples; a tooth has 32"),
        ({"turns": []}, r"turns: none"),
        ({"where": "torque > 1e9"}, r"no template of this length meets where = 'torque > 1e9'"),
        ({"where": "fm4 > 3"}, r"where = 'fm4 > 3': .*not found"),
        ({"where": "true) --"}, r"where = 'true\) --'"),
    ],
)
def test_what_cannot_be_matched(database, options, says):
    with pytest.raises(InputError, match=says):
        database.match(**{"tsa": np.sin(np.arange(384.0))} | options)


def test_outside_by_the_threshold_that_is_stored(copy):
    database = sigdb.open(copy)
    x = database.signals([400])["tsa"][0]
    unknown = database.match(x)
    assert (unknown.outside, unknown.threshold) == (None, None)
    assert unknown.table["outside"].isna().all()
    assert "sigdb coverage has not been run" in str(unknown)
    distances = unknown.table["residual_distance"]
    plans = tuple(plan.hash for plan in database.manifest.plans)
    for threshold, outside in ((distances[0] * 1.001, False), (distances[0] * 0.999, True)):
        record = CoverageRecord(threshold=threshold, sensor="pinion-vertical", plans=plans)
        write_coverage(database.store, record)
        found = sigdb.open(copy).match(x)
        assert found.outside is outside
        assert str(found).startswith("outside the database" if outside else "inside the database")
        assert found.table["outside"].tolist() == (distances > threshold).tolist()
    # Of another sensor, or of what the database was before, nothing is known.
    y = database.signals([400], sensor=SECOND)["tsa"][0]
    assert database.match(y, sensor=SECOND).outside is None
    write_coverage(database.store, CoverageRecord(threshold=1.0, sensor="pinion-vertical", plans=("other",)))
    assert database.match(x).outside is None
    (copy / COVERAGE_FILE).write_text("{}", encoding="utf-8")
    with pytest.raises(DatabaseError, match=r"coverage\.json.*; run sigdb coverage again"):
        database.match(x)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("SIGDB_CACHE", str(folder))
    return folder


def test_where_the_cache_is(cache, monkeypatch):
    assert cache_folder() == cache
    monkeypatch.delenv("SIGDB_CACHE")
    assert cache_folder().name == "sigdb"


def test_the_cache_is_made_once_and_used(folder, cache, monkeypatch):
    x = sigdb.open(folder).signals([400])["tsa"][0]
    first = sigdb.open(folder).match(x)
    (file,) = cache.iterdir()
    monkeypatch.setattr("sigdb.database.matching.match.index_batches", None)  # to be called no more
    pd.testing.assert_frame_equal(sigdb.open(folder).match(x).table, first.table)
    assert list(cache.iterdir()) == [file]


@pytest.mark.parametrize("offset", ["empty", 1, 700, 2000, -1, -4])
def test_a_damaged_cache_is_made_again(folder, cache, offset):
    x = sigdb.open(folder).signals([400])["tsa"][0]
    first = sigdb.open(folder).match(x)
    (file,) = cache.iterdir()
    content = file.read_bytes()
    broken = bytearray(content)
    if offset == "empty":
        broken = bytearray(b"\0\0\0\0")
    else:
        broken[offset] ^= 16
    for wrong in (bytes(broken), content[: len(content) // 2], b""):
        file.write_bytes(wrong)
        pd.testing.assert_frame_equal(sigdb.open(folder).match(x).table, first.table)
        assert file.read_bytes() == content


def test_a_cache_of_another_name_is_not_believed(folder, parts_folder, cache):
    """Its sum covers its name: files that were exchanged are made again."""
    one, other = sigdb.open(folder), sigdb.open(parts_folder)
    x, y = (np.roll(some.signals([some.manifest.rows - 60])["tsa"][0], 5) for some in (one, other))
    assert x.size == y.size == 352
    first, second = one.match(x), other.match(y)
    a, b = cache.iterdir()
    a_bytes, b_bytes = a.read_bytes(), b.read_bytes()
    a.write_bytes(b_bytes)
    b.write_bytes(a_bytes)
    pd.testing.assert_frame_equal(sigdb.open(folder).match(x).table, first.table)
    pd.testing.assert_frame_equal(sigdb.open(parts_folder).match(y).table, second.table)


def test_a_cache_that_cannot_be_written_is_done_without(folder, tmp_path, monkeypatch):
    x = sigdb.open(folder).signals([400])["tsa"][0]
    expected = sigdb.open(folder).match(x).table
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SIGDB_CACHE", str(tmp_path / "file" / "below"))
    pd.testing.assert_frame_equal(sigdb.open(folder).match(x).table, expected)


def test_a_changed_database_has_another_cache(copy, cache):
    database = sigdb.open(copy)
    x = database.signals([400])["tsa"][0]
    database.match(x)
    database.match(database.signals([400], sensor=SECOND)["tsa"][0], sensor=SECOND)
    assert len(list(cache.iterdir())) == 2


def test_a_damaged_template_is_no_match(copy, cache):
    path = copy / "templates" / "part-00000.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)
    database = sigdb.open(copy)
    with pytest.raises(DatabaseError, match=r"templates.part-00000\.parquet is damaged"):
        database.match(np.sin(np.arange(384.0)))
    assert not cache.exists() or not list(cache.iterdir())
