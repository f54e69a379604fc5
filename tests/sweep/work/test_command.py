"""Unit: ``python -m sigdb.sweep``: what it prints, its exit codes, and no traceback for what a user can mend."""

import json
import runpy
import sys

import pytest

import sigdb
from sigdb.cli.commands.sweep import sweep
from sigdb.cli.main import main
from sigdb.sweep.work import estimate

GRID = "[[sweep.grid]]\ntooth = [1, 2]\nstiffness_loss = 0.2\n"
SMALL = '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical"]\n'


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """Run the command in an empty folder; its exit code and what it printed."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["sigdb.sweep", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main(sweep, "python -m sigdb.sweep")
        told = capsys.readouterr()
        assert "Traceback" not in told.err
        return left.value.code or 0, told.out, told.err

    return call


def test_it_makes_a_database_and_then_has_nothing_to_do(command, recipe_of, tmp_path):
    recipe = recipe_of("healthy = 3\n" + GRID + SMALL).path
    code, out, err = command(recipe, "--jobs", 1)
    assert code == 0, err
    assert "data/recipe/signatures: 5 rows from 2 templates of rig nasa-spiral-bevel" in out
    assert "made 5 rows in" in out
    folder = tmp_path / "data" / "recipe" / "signatures"
    assert len(sigdb.open(folder)) == 5
    assert sigdb.open(folder).manifest.recipe == recipe.read_text(encoding="utf-8")
    code, out, _ = command(recipe, "--jobs", 1)
    assert code == 0
    assert "nothing to do, all 5 rows are there" in out


def test_the_module_is_the_command(recipe_of, tmp_path, monkeypatch, capsys):
    recipe = recipe_of(GRID + SMALL).path
    monkeypatch.setattr(sys, "argv", ["sigdb.sweep", str(recipe), "--out", str(tmp_path / "out"), "--jobs", "1"])
    with pytest.raises(SystemExit) as left:
        runpy.run_module("sigdb.sweep", run_name="__main__")
    out, err = capsys.readouterr()
    assert not left.value.code, err
    assert "made 2 rows" in out
    assert "rows: 2 of 2" in err


def test_failed_rows_are_told_with_a_query_that_shows_why(command, recipe_of, tmp_path):
    rough = "[[sweep.grid]]\ntooth = [1, 2]\nstiffness_loss = 0.3\nindex_error = 1e-4\n"
    code, out, _ = command(recipe_of(GRID + rough + SMALL).path, "--out", tmp_path / "out", "--jobs", 1)
    assert code == 0
    assert "2 rows have no result; their status says why: sigdb query" in out
    query = out.split('"')[1]
    found = sigdb.open(tmp_path / "out").sql(query).set_index("reason")
    assert found["rows"].to_dict() == {"ok": 2, "contact": 2}
    assert "loses contact" in found.loc["contact", "example"]


def test_a_dry_run_without_measuring_simulates_nothing(command, recipe_of, tmp_path, monkeypatch):
    monkeypatch.setattr("sigdb.sweep.estimate", None)
    recipe = recipe_of("healthy = 3\n" + GRID + SMALL).path
    code, out, err = command(recipe, "--dry-run", "--no-measure", "--out", tmp_path / "out")
    assert code == 0, err
    assert "would hold 5 rows from 2 templates, in 1 parts" in out
    assert "measured" not in out
    assert "first rows of the plan" in out
    assert not (tmp_path / "out").exists()


def test_a_dry_run_tells_and_writes_nothing(command, recipe_of, tmp_path):
    code, out, err = command(recipe_of("healthy = 3\n" + GRID + SMALL).path, "--dry-run", "--out", tmp_path / "out")
    assert code == 0, err
    assert "would hold 5 rows from 2 templates, in 1 parts" in out
    assert "MB and" in out
    table = out[out.index("first rows of the plan") :].splitlines()
    assert len(table) == 1 + 1 + 5
    assert table[1].split()[:3] == ["id", "template", "gear"]
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_estimates_the_size(command, recipe_of, tmp_path):
    recipe = recipe_of("healthy = 100\n" + GRID + "[signature]\nsamples_per_tooth = 32\n").path
    _, out, _ = command(recipe, "--dry-run", "--out", tmp_path / "out", "--jobs", 1)
    told = float(out.split("about ")[1].split(" MB")[0])
    command(recipe, "--out", tmp_path / "out", "--jobs", 1)
    made = sum(path.stat().st_size for path in (tmp_path / "out").rglob("*.parquet")) / 1e6
    assert told == pytest.approx(made, rel=0.1)


def test_a_dry_run_shows_the_first_damaged_rows_too(command, recipe_of, tmp_path):
    recipe = recipe_of("healthy = 300\nspecimens = 2\n" + GRID + SMALL).path
    _, out, _ = command(recipe, "--dry-run", "--jobs", 1)
    header, *rows = (line.split() for line in out[out.index("first rows of the plan") :].splitlines()[1:])
    assert [int(row[0]) for row in rows] == [0, 1, 2, 3, 4, 600, 601, 602, 603]
    # An empty pattern leaves no word.
    at = header.index("tooth") - 1
    assert [int(row[at]) for row in rows] == [0] * 5 + [1, 1, 2, 2]


def test_a_dry_run_as_json(command, recipe_of, tmp_path):
    recipe = recipe_of("healthy = 3\n" + GRID + SMALL).path
    _, out, _ = command(recipe, "--dry-run", "--jobs", 1, "--format", "json")
    told = json.loads(out)
    assert (told["rows"], told["templates"], told["parts"], told["jobs"]) == (5, 2, 1, 1)
    assert told["bytes"] > 0
    assert [row["tooth"] for row in told["first_rows"]] == [0, 0, 0, 1, 2]
    assert list(tmp_path.iterdir()) == []


def test_a_large_plan_is_estimated_from_few_of_its_templates(command, recipe_of, monkeypatch):
    """At most eight for each of two samples of rows, and no more batches after the time for them."""
    made = []
    make = estimate.template_table

    def counted(plan, schema, part, numbers):
        made.append([number for number in plan.template_range(part) if number in numbers])
        return make(plan, schema, part, numbers)

    monkeypatch.setattr(estimate, "template_table", counted)
    monkeypatch.setattr(estimate, "_SECONDS", 0.0)
    recipe = recipe_of(
        "healthy = 1\n[[sweep.grid]]\nstiffness_loss = { min = 0.1, max = 0.4 }\npoints = 2000\n"
        "tooth = { min = 1, max = 12 }\n" + SMALL
    ).path
    _, out, err = command(recipe, "--dry-run", "--jobs", 1)
    assert "would hold 2001 rows from 2001 templates, in 1 parts" in out, err
    assert sum(map(len, made)) == 8 + 8 + 1 + 8
    assert made[-1] == list(range(1000, 1008))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[sweep\n", "not valid TOML"),
        ('[sweep]\nrig = "nasa-spiral-bevel"\n' + GRID + "stifness_loss = 0.1\n", "did you mean 'stiffness_loss'?"),
        ('[sweep]\nrig = "nasa-spiral-bevel"\nseed = "x"\n' + GRID, "sweep.seed = 'x' must be a valid integer"),
        ('[sweep]\nrig = "nasa-spiral-bevel"\nspecimens = 0\n' + GRID, "sweep.specimens = 0 must be"),
        ('[sweep]\nrig = "nasa"\n' + GRID, "no built-in rig 'nasa'"),
        ('[sweep]\nrig = "nasa-spiral-bevel"\n' + GRID + "averages = 0\n", "averages = 0 must be"),
        ('[sweep]\nrig = "nasa-spiral-bevel"\n' + GRID + "pinion.teeth = 2\n", "teeth = 2 must be"),
        ('[sweep]\nrig = "nasa-spiral-bevel"\n[[sweep.grid]]\n', "the sweep has no rows"),
    ],
)
@pytest.mark.parametrize("option", [["--jobs", "1"], ["--dry-run"]])
def test_bad_input_is_exit_code_2_and_a_sentence(command, tmp_path, text, says, option):
    (tmp_path / "bad.toml").write_text(text, encoding="utf-8")
    code, _, err = command("bad.toml", *option)
    assert code == 2
    assert err.startswith("python -m sigdb.sweep: error: ")
    assert says in err
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["none.toml"], "none.toml: no such file"),
        ([], "Missing argument 'RECIPE'"),
        (["none.toml", "--jobs", "0"], "0; give 1 or more, or -1"),
        (["none.toml", "--jobs", "two"], "'two' is not a valid int"),
        (["none.toml", "--jbos", "2"], "--jobs"),
        ([__file__, "--job", "2"], "job '2' must be the number of a job and that of all jobs, such as 2/8"),
    ],
)
def test_bad_arguments_are_exit_code_2(command, arguments, says):
    code, _, err = command(*arguments)
    assert code == 2
    assert says in err


def test_another_recipe_is_exit_code_2(command, recipe_of, tmp_path):
    command(recipe_of(GRID + SMALL).path, "--out", tmp_path / "out", "--jobs", 1)
    code, _, err = command(recipe_of("seed = 5\n" + GRID + SMALL).path, "--out", tmp_path / "out", "--jobs", 1)
    assert code == 2
    assert "was made from another recipe: sweep.seed was 0 and is now 5; give another directory with --out" in err


def test_a_place_that_cannot_be_written_is_exit_code_3(command, recipe_of, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    code, _, err = command(recipe_of(GRID + SMALL).path, "--out", tmp_path / "file" / "out", "--jobs", 1)
    assert code == 3
    assert "file/out: cannot be written (Not a directory)" in err
