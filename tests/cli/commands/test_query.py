"""Unit: what the commands print is what the library says, in every format."""

import io
import json
import re
from dataclasses import replace

import h5py
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose
from scipy.io import loadmat

import sigdb
from sigdb.cli.main import cli
from sigdb.core.errors import InputError
from sigdb.pipeline import evaluate_model
from sigdb.recognition import CriteriaSettings, Estimate, RecognitionSettings, evaluate, load_model
from sigdb.transmission import coupled_modes

SCALARS = "select id, tooth, snr_db, index_error, fm4, status, contact_loss from cases order by id limit 70"


@pytest.fixture(scope="module", autouse=True)
def _evaluated_once():
    """Commands of the same model and criteria find its evaluation computed."""
    known = {}

    def remembered(model, database, **options):
        asked = model.target, model.learner, repr(options)
        if asked not in known:
            known[asked] = evaluate(model, database, **options)
        return known[asked]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sigdb.pipeline.models.evaluate", remembered)
        yield


@pytest.fixture(scope="module")
def modes():
    return coupled_modes(sigdb.load_transmission("nasa-spiral-bevel"))


def test_modes_as_json(invoke, modes):
    rows = json.loads(invoke("modes", "nasa-spiral-bevel", "--format", "json").stdout)
    assert len(rows) == len(modes.frequency_hz)
    assert {tuple(row) for row in rows} == {("frequency_hz", "damping_ratio", "moves")}
    assert_allclose([row["frequency_hz"] for row in rows], modes.frequency_hz, rtol=1e-12)
    assert_allclose([row["damping_ratio"] for row in rows], modes.damping_ratio, rtol=1e-12)
    assert_allclose([sum(row["moves"].values()) for row in rows], 1, rtol=1e-6)
    assert len(json.loads(invoke("modes", "nasa-spiral-bevel", "--format", "json", "--count", 3).stdout)) == 3


def test_modes_as_a_table(invoke, modes):
    head, *lines = invoke("modes", "nasa-spiral-bevel", "--count", 4).stdout.splitlines()
    assert "frequency, Hz" in head
    assert "damping ratio" in head
    assert len(lines) == 4
    assert [int(line.split()[0]) for line in lines] == [1, 2, 3, 4]
    assert_allclose([float(line.split()[1]) for line in lines], modes.frequency_hz[:4], rtol=0, atol=0.051)


def test_a_query_as_csv(invoke, folder, database):
    printed = invoke("query", folder / "signatures", SCALARS, "--format", "csv").stdout
    assert printed.endswith("\n")
    assert not printed.endswith("\n\n")
    found = pd.read_csv(io.StringIO(printed))
    expected = database.sql(SCALARS)
    assert list(found) == list(expected)
    for name in expected:
        if expected[name].dtype.kind == "f":
            assert_allclose(found[name], expected[name], rtol=1e-7)
        else:
            assert found[name].tolist() == expected[name].tolist()


def test_a_query_as_json(invoke, folder, database):
    rows = json.loads(invoke("query", folder / "signatures", SCALARS, "--format", "json").stdout)
    expected = database.sql(SCALARS)
    assert len(rows) == len(expected)
    for name in expected:
        column = [row[name] for row in rows]
        if expected[name].dtype.kind == "f":
            assert_allclose(column, expected[name], rtol=1e-7)
        else:
            assert column == expected[name].tolist()


@pytest.mark.parametrize("form", ["csv", "json"])
def test_small_numbers_keep_their_digits(invoke, folder, form):
    query = "select 1.23456789012345e-9::double as small, 1.23456789012345e9::double as great"
    printed = invoke("query", folder / "signatures", query, "--format", form).stdout
    found = json.loads(printed)[0] if form == "json" else pd.read_csv(io.StringIO(printed)).iloc[0].to_dict()
    assert found == pytest.approx({"small": 1.23456789012345e-9, "great": 1.23456789012345e9}, rel=1e-13, abs=0)


@pytest.mark.parametrize("form", ["csv", "json", "parquet"])
def test_lists_are_given_whole(invoke, folder, database, form):
    query = "select id, tsa from signals order by id limit 2"
    printed = invoke("query", folder / "signatures", query, "--format", form).stdout_bytes
    if form == "parquet":
        found = pq.read_table(io.BytesIO(printed))["tsa"].to_pylist()
    elif form == "json":
        found = [row["tsa"] for row in json.loads(printed)]
    else:
        found = [json.loads(cell) for cell in pd.read_csv(io.BytesIO(printed))["tsa"]]
    assert_allclose(np.array(found), database.signals([0, 1])["tsa"], rtol=1e-6)


def test_nothing_is_null(invoke, folder):
    query = "select 'a,\"b\"' as text, null::double as nothing, 'nan'::double as nan"
    rows = json.loads(invoke("query", folder / "signatures", query, "--format", "json").stdout)
    assert rows == [{"text": 'a,"b"', "nothing": None, "nan": None}]
    found = pd.read_csv(io.StringIO(invoke("query", folder / "signatures", query, "--format", "csv").stdout))
    assert found["text"].tolist() == ['a,"b"']
    assert found[["nothing", "nan"]].isna().all(axis=None)


def test_a_query_as_parquet(invoke, folder, database, tmp_path):
    printed = invoke("query", folder / "signatures", SCALARS, "--format", "parquet").stdout_bytes
    expected = database.arrow(SCALARS)
    assert pq.read_table(io.BytesIO(printed)).equals(expected)
    result = invoke("query", folder / "signatures", SCALARS, "--format", "parquet", "--out", tmp_path / "a.parquet")
    assert result.output == ""
    assert pq.read_table(tmp_path / "a.parquet").equals(expected)


def test_a_query_as_a_table(invoke, folder):
    query = "select tooth, count(*) as rows from cases group by tooth order by tooth"
    lines = [line.split() for line in invoke("query", folder / "signatures", query).stdout.splitlines()]
    assert lines == [["tooth", "rows"], ["0", "30"], ["1", "12"], ["6", "12"], ["7", "12"], ["(4", "rows)"]]


def test_a_query_without_rows(invoke, folder):
    query = "select id, tooth from cases where tooth = 99"
    assert json.loads(invoke("query", folder / "signatures", query, "--format", "json").stdout) == []
    assert invoke("query", folder / "signatures", query, "--format", "csv").stdout == "id,tooth\n"
    assert invoke("query", folder / "signatures", query).stdout.endswith("(0 rows)\n")


@pytest.mark.parametrize("form", ["csv", "json", "parquet"])
def test_a_query_of_many_batches(invoke, folder, form):
    """Every row once, in order, over the borders of batches."""
    query = "select range as i, 'x,' || range as text from range(20000)"
    printed = invoke("query", folder / "signatures", query, "--format", form).stdout_bytes
    read = {"csv": pd.read_csv, "json": pd.read_json, "parquet": pd.read_parquet}[form]
    found = read(io.BytesIO(printed))
    assert found["i"].tolist() == list(range(20000))
    assert found["text"].iloc[-1] == "x,19999"


@pytest.mark.parametrize("rows", [59, 60, 61, 90, 8192, 8193, 20000])
def test_a_long_table_shows_its_beginning_and_its_end(invoke, folder, rows):
    printed = invoke("query", folder / "signatures", f"select range as i from range({rows})").stdout
    head, *lines, count = (line.strip() for line in printed.splitlines())
    shown = [str(i) for i in range(rows)]
    assert (head, count) == ("i", f"({rows} rows)")
    assert lines == (shown if rows <= 60 else [*shown[:30], "...", *shown[-30:]])


def test_values_that_json_does_not_know_are_text(invoke, folder):
    query = "select 1.25::decimal(5, 2) as d, date '2026-01-31' as day, time '12:30' as time, [1.5, 'nan'::double] as l"
    (row,) = json.loads(invoke("query", folder / "signatures", query, "--format", "json").stdout)
    assert row == {"d": "1.25", "day": "2026-01-31", "time": "12:30:00", "l": [1.5, None]}


def test_match_as_json(invoke, folder, database):
    row = 30 + 12 + 5
    result = invoke("match", folder / "signatures", "--id", row, "--k", 4, "--format", "json")
    found = pd.DataFrame(json.loads(result.stdout))
    expected = database.match(database.signals([row])["tsa"][0], k=4)
    assert found["template"].tolist() == expected.table["template"].tolist()
    assert_allclose(
        found[["turn", "match", "residual_distance"]],
        expected.table[["turn", "match", "residual_distance"]],
        rtol=1e-12,
    )
    assert found["outside"].isna().all()
    assert result.stderr == f"{expected}\n"


@pytest.mark.parametrize("kind", ["txt", "csv", "npy"])
def test_match_of_a_recording(invoke, folder, database, tmp_path, kind):
    x = database.signals([47])["tsa"][0].astype(float)
    path = tmp_path / f"average.{kind}"
    if kind == "npy":
        np.save(path, x[None, :])
    else:
        path.write_text("# one revolution\n" + "".join(f"{value!r}\n" for value in x.tolist()), encoding="utf-8")
    printed = invoke("match", folder / "signatures", path, "--whole-teeth", "--where", "stiffness_loss > 0").stdout
    table = database.match(x, turns=range(12), where="stiffness_loss > 0").table
    head, *lines, count, verdict = printed.splitlines()
    assert head.split()[:6] == ["template", "tooth", "turn", "match", "residual_distance", "outside"]
    assert [int(line.split()[0]) for line in lines] == table["template"].tolist()
    assert [int(line.split()[1]) for line in lines] == table["tooth"].tolist()
    assert count == f"({len(table)} rows)"
    assert "sigdb coverage has not been run" in verdict


@pytest.mark.parametrize("content", [b"", b"a\nb\n", b"1 2\n3\n"])
def test_a_recording_that_is_none(folder, tmp_path, content):
    for name in ("average.txt", "average.npy"):
        (tmp_path / name).write_bytes(content)
        result = CliRunner().invoke(cli, ["match", str(folder / "signatures"), str(tmp_path / name)])
        assert isinstance(result.exception, InputError)
        assert f"{tmp_path / name}: not one revolution" in str(result.exception)


@pytest.mark.parametrize("kind", ["mat", "h5"])
def test_export(invoke, folder, database, tmp_path, kind):
    out = tmp_path / f"tooth6.{kind}"
    printed = invoke("export", folder / "signatures", out, "--where", "tooth = 6", "--no-signals").stdout
    columns = len(database.features("id = 0").columns)
    assert printed.startswith(f"{out}: 12 rows, {columns} columns, ")
    expected = database.cases("tooth = 6")["fm4"]
    found = loadmat(out)["cases"][0, 0]["fm4"][:, 0] if kind == "mat" else h5py.File(out)["cases/fm4"][:]
    assert found.tolist() == expected.astype(float).tolist()


def test_show_draws_into_the_file_that_it_names(invoke, folder, tmp_path, monkeypatch):
    result = invoke("show", folder / "signatures", 31, "--out", tmp_path / "a" / "row.svg")
    assert result.stdout == f"{tmp_path / 'a' / 'row.svg'}: row 31 of {folder / 'signatures'}\n"
    assert b"<svg" in (tmp_path / "a" / "row.svg").read_bytes()
    monkeypatch.chdir(tmp_path)
    invoke("show", folder / "signatures", 0, "--sensor", "pinion-vertical")
    assert (tmp_path / "signature-0.png").read_bytes().startswith(b"\x89PNG")


def test_train_writes_a_model_that_evaluates_to_what_it_printed(invoke, folder, tmp_path):
    out = tmp_path / "model"
    result = invoke("train", folder / "signatures", "--target", "location", "--out", out, "--learner", "boosting")
    few = "sets and intervals of 0.9 need 9 specimens; the training rows are of 2, so these hold all answers"
    first, second, *others = (line.removeprefix("training location: ") for line in result.stderr.splitlines())
    assert (first, second) == (few, "reading averages")
    assert sorted(others) == sorted(load_model(out).estimators)
    *table, last = result.stdout.splitlines()
    assert last == f"model and card: {out}"
    assert invoke("evaluate", out, folder / "signatures").stdout.splitlines() == table
    command = f"sigdb train {folder / 'signatures'} --target location --out {out} --learner boosting"
    assert command in (out / "README.md").read_text()
    assert load_model(out).learner == "boosting"


def test_train_takes_the_learner_and_the_folds_of_the_recipe(folder):
    model = load_model(folder / "location")
    assert model.learner == "lda"
    assert len(model.trained_on) == 2


def test_train_severity(invoke, folder, tmp_path):
    result = invoke("train", folder / "signatures", "--target", "severity", "--out", tmp_path / "model")
    assert "MAE stiffness_loss" in result.stdout
    assert "coverage of 90 % interval, stiffness_loss" in result.stdout
    assert load_model(tmp_path / "model").target == "severity"


def test_evaluate_as_a_table(invoke, folder, database):
    evaluation = evaluate(load_model(folder / "location"), database, bound=False)
    head, names, *lines = invoke("evaluate", folder / "location", folder / "signatures").stdout.splitlines()
    assert head.startswith(f"location: {10 + 3 * 4} rows of 1 specimens.")
    assert names.split()[0] == "metric"
    assert "lda (the model)" in names
    (exact,) = (line for line in lines if line.startswith("P(exact tooth)"))
    assert f"{evaluation.metrics['lda']['p_exact'].value:.3f}" in exact
    assert any("95 % interval" in line for line in lines)


def test_evaluate_writes_a_report(invoke, folder, tmp_path):
    words = ("evaluate", folder / "location", folder / "signatures")
    result = invoke(*words, "--report", tmp_path / "report")
    assert result.stderr.splitlines()[-1] == f"report: {tmp_path / 'report' / 'index.html'}"
    assert result.stdout == invoke(*words).stdout
    numbers = json.loads((tmp_path / "report" / "evaluation.json").read_text(encoding="utf-8"))
    (exact,) = (line for line in result.stdout.splitlines() if line.startswith("P(exact tooth)"))
    assert f"{numbers['metrics']['lda']['p_exact']['value']:.3f}" in exact


def test_evaluate_leaves_with_1_when_a_model_is_above_the_bound(folder, monkeypatch, capsys):
    best = {"accuracy": Estimate(value=0.01, low=0.0, high=0.02)}

    def too_good(model, database, **options):
        return replace(evaluate(model, database, bound=False), bound=best, above=("accuracy",))

    monkeypatch.setattr("sigdb.pipeline.models.evaluate", too_good)
    assert cli.main(["evaluate", str(folder / "location"), str(folder / "signatures")], standalone_mode=False) == 1
    out, err = capsys.readouterr()
    assert "is better than the best possible answer (accuracy" in err
    assert out.splitlines()[1].split()[-1] == "bound"


def test_evaluate_as_json(invoke, folder, database):
    rows = json.loads(invoke("evaluate", folder / "location", folder / "signatures", "--format", "json").stdout)
    evaluation = evaluate_model(load_model(folder / "location"), database)
    metrics = evaluation.metrics | {"bound": evaluation.bound}
    assert {tuple(row) for row in rows} == {("estimator", "metric", "value", "low", "high")}
    assert len(rows) == sum(map(len, metrics.values()))
    for row in rows:
        estimate = metrics[row["estimator"]][row["metric"]]
        expected = [None if np.isnan(end) else end for end in (estimate.value, estimate.low, estimate.high)]
        assert [row["value"], row["low"], row["high"]] == expected
    assert None in [row["value"] for row in rows]  # the bias of a majority that never calls a tooth


def test_criteria_are_those_of_the_database_s_recipe(invoke, folder, database, monkeypatch):
    assert "Criteria:" not in invoke("evaluate", folder / "location", folder / "signatures").stdout
    settings = RecognitionSettings(criteria=CriteriaSettings(loss_db=0.25, a90_ratio=1.05))
    monkeypatch.setattr("sigdb.pipeline.models.recipe_section", lambda database, section, name: settings)
    criteria = evaluate_model(load_model(folder / "location"), database).criteria
    assert [(result.criterion, result.limit) for result in criteria] == [("loss_db", 0.25), ("a90_ratio", 1.05)]
    lines = invoke("evaluate", folder / "location", folder / "signatures").stdout.split("Criteria:")[1].splitlines()
    assert lines[1].split() == ["criterion", "at", "most", "value", "noise", "met"]
    assert re.search(r"^a90 over the bound's, .* 1\.05 +- +not estimated$", "\n".join(lines), re.MULTILINE)
