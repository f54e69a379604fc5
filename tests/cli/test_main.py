"""Unit: exit codes, messages of one line, and how the commands behave in a pipe."""

import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli import commands
from sigdb.cli.main import ExitCode, cli
from sigdb.cli.options import places

COMMANDS = (
    *("new-rig", "describe", "modes", "run", "sweep", "verify", "coverage", "refine", "card", "identify"),
    *("query", "show", "match", "signature", "export", "train", "evaluate", "diagnose", "explore", "ingest", "label"),
    *("add-features", "monitor", "public-sets", "plan-measurement", "fuse", "assess"),
)
SIGDB = Path(sys.executable).with_name("sigdb")


def names():
    return cli.list_commands(click.Context(cli))


def test_the_commands_are_these():
    assert set(names()) == set(COMMANDS)


def test_a_module_of_commands_is_a_command_without_another_line(monkeypatch, tmp_path):
    source = "import click\n\n@click.command()\ndef my_own():\n    'Say hello.'\n    click.echo('hello')\n"
    (tmp_path / "my_own.py").write_text(source, encoding="utf-8")
    monkeypatch.setattr(commands, "__path__", [*commands.__path__, str(tmp_path)])
    monkeypatch.delitem(sys.modules, "sigdb.cli.commands.my_own", raising=False)
    assert names()[-1] == "my-own"
    assert CliRunner().invoke(cli, ["my-own"]).output == "hello\n"
    monkeypatch.delitem(sys.modules, "sigdb.cli.commands.my_own")


def test_the_help_imports_no_heavy_library(shell):
    text = "import sys\nfrom sigdb.cli import main\ntry: main()\nexcept SystemExit: pass\nprint(sorted(sys.modules))"
    loaded = shell("-c", text, "--help", command=[sys.executable]).stdout.splitlines()[-1]
    assert "'sigdb.cli.commands.query'" in loaded
    for heavy in ("numpy", "pandas", "pint", "pyarrow", "rich", "matplotlib", "jinja2"):
        assert f"'{heavy}'" not in loaded


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_every_command_has_help(command, option):
    result = CliRunner().invoke(cli, [command, option])
    assert result.exit_code == 0
    assert result.stdout.startswith(f"Usage: cli {command}")
    assert result.stdout.count("\n\n") >= 2
    for parameter in cli.get_command(click.Context(cli), command).params:
        if parameter.param_type_name == "option" and parameter.name != "help":
            assert parameter.help, f"{command} {parameter.name} has no help"


def test_the_version_is_told(shell):
    done = shell("--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"sigdb, version {sigdb.__version__}\n", "")


def test_python_m_sigdb_is_sigdb(shell):
    for arguments in (["--help"], ["query", "db"]):
        one, other = shell(*arguments), shell(*arguments, command=[SIGDB])
        assert (one.returncode, one.stdout, one.stderr) == (other.returncode, other.stdout, other.stderr)
        assert "sigdb" in one.stdout + one.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["query", "{db}", "drop table cases"], "must be one SELECT statement; a database is read-only"),
        (["query", "{db}", "select 1; select 2"], "must be one SELECT statement"),
        (["query", "{db}", "copy cases to 'x.csv'"], "must be one SELECT statement"),
        (["query", "{db}", "selec id"], "query: syntax error"),
        (["query", "{db}", "select nothing from cases"], '"nothing" not found'),
        (["query", "{db}", "select * from read_csv('/etc/passwd')"], "read_csv() is not a table that it may read"),
        (["query", "{missing}", "select 1"], "is not a sigdb database"),
        (["show", "{missing}", "0"], "is not a sigdb database"),
        (["show", "{db}", "99999"], "id 99999 is not in"),
        (["show", "{db}", "0", "--sensor", "wheel"], "sensor 'wheel' is not stored"),
        (["show", "{db}", "0", "--out", "row.txt"], "not a picture's name"),
        (["match", "{missing}", "--id", "0"], "is not a sigdb database"),
        (["match", "{db}", "--id", "99999"], "id 99999 is not in"),
        (["match", "{db}", "--id", "0", "--where", "true) --"], "where = 'true) --'"),
        (["match", "{db}", "{db}/sigdb.toml"], "a raw recording goes to sigdb diagnose"),
        (["export", "{missing}", "a.mat"], "is not a sigdb database"),
        (["export", "{db}", "a.txt"], "a.txt: the name of an export ends in .mat, .h5 or .hdf5"),
        (["export", "{db}", "a.h5", "--where", "tuth = 1"], "where = 'tuth = 1'"),
        (
            ["export", "{db}", "a.h5", "--where", "id in (from range(1000000000000))", "--max-seconds", "0.2"],
            "was stopped after 0.2 s, which is its limit; ask for less, or raise max_seconds (--max-seconds)",
        ),
        (["export", "{db}"], "OUT is missing: a file OUT.mat or OUT.h5; or give --delta or --iceberg CATALOG"),
        (["export", "{db}", "a.h5", "--delta"], "register all of DB; leave out OUT"),
        (["export", "{db}", "--delta", "--namespace", "a"], "--namespace is of a catalog; give --iceberg CATALOG too"),
        (["export", "{db}", "--iceberg", "nowhere"], "--iceberg nowhere: the catalog cannot be opened"),
        (["train", "{missing}", "--target", "location", "--out", "{missing}"], "is not a sigdb database"),
        (["evaluate", "{missing}", "{db}"], "is not a model folder"),
        (["evaluate", "{model}", "{missing}"], "is not a sigdb database"),
        (["modes", "nothing"], "no built-in rig 'nothing'; known: chaari-8dof, "),
        (["modes", "nothing.toml"], "nothing.toml: no such file"),
        (["run", "nothing.toml"], "nothing.toml: no such file"),
    ],
)
def test_bad_input_is_told_in_one_line_and_exit_code_2(leave, folder, tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    names = {"db": folder / "signatures", "model": folder / "location", "missing": tmp_path / "missing"}
    code, out, err = leave(*(one.format(**names) for one in arguments))
    assert (code, out) == (2, "")
    (line,) = err.splitlines()
    assert line.startswith("sigdb: error: ")
    assert says in line
    assert list(tmp_path.iterdir()) == []


def test_the_package_names_every_exit_code():
    text = " ".join(sigdb.cli.__doc__.split()).partition("Exit codes: ")[2]
    assert [int(part.split()[0]) for part in text.rstrip(".").split(", ")] == sorted(ExitCode)


def test_missing_places_are_refused_before_slow_imports(shell):
    text = "import sys\nfrom sigdb.cli import main\ntry: main()\nexcept SystemExit: pass\nprint(sorted(sys.modules))"
    done = shell("-c", text, "show", "nowhere", "0", command=[sys.executable])
    assert done.stderr.startswith("sigdb: error: nowhere is not a sigdb database (it has no sigdb.toml); make one with")
    for heavy in ("numpy", "pandas", "pyarrow", "matplotlib"):
        assert f"'{heavy}'" not in done.stdout


def test_exit_codes_are_those_of_the_process(shell, tmp_path):
    done = shell("query", tmp_path / "missing", "select 1")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nothing"], "No such command 'nothing'"),
        (["train", "db", "--out", "x"], "Missing option '--target'"),
        (["train", "db", "--out", "x", "--target", "wear"], "'wear' is not one of 'location', 'severity'"),
        (["query", "db"], "Missing argument 'SQL'"),
        (["show", "db", "first"], "'first' is not a valid integer"),
        (["match", "db"], "Give either RECORDING or --id."),
        (["match", "db", "a.txt", "--id", "3"], "Give either RECORDING or --id."),
        (["match", "db", "a.txt", "--k", "0"], "0 is not in the range"),
        (["modes", "nasa-spiral-bevel", "--count", "0"], "0 is not in the range"),
        (["coverage", "db", "--cases", "0"], "0 is not in the range"),
        (["refine", "db", "--rounds", "0"], "0 is not in the range"),
        (["refine", "db", "--jobs", "-2"], "-2; give 1 or more, or -1"),
        (["run", "recipe.toml", "--jobs", "0"], "0; give 1 or more, or -1"),
    ],
)
def test_bad_usage_is_exit_code_2(leave, monkeypatch, arguments, says):
    for check in ("check_exists", "check_database"):
        monkeypatch.setattr(places, check, lambda path: None)
    code, out, err = leave(*arguments)
    assert (code, out) == (2, "")
    assert says in err


def test_a_query_reads_only(leave, folder):
    def files():
        return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}

    before = files()
    assert leave("query", folder / "signatures", "select count(*) from features")[0] == 0
    assert leave("query", folder / "signatures", "delete from features")[0] == 2
    assert files() == before


def test_a_damaged_model_is_told_without_a_traceback(leave, folder, tmp_path):
    for name in ("model.skops", "probe.npz"):
        broken = shutil.copytree(folder / "location", tmp_path / name)
        (broken / name).write_bytes(b"nonsense")
        code, _, err = leave("evaluate", broken, folder / "signatures")
        assert "Traceback" not in err
        assert code == 2
        assert str(broken) in err


def test_a_damaged_database_is_exit_code_3(leave, folder, tmp_path):
    broken = shutil.copytree(folder / "signatures", tmp_path / "broken")
    (broken / "sigdb.toml").write_text("format = 1\n")
    code, out, err = leave("query", broken, "select 1")
    assert (code, out) == (3, "")
    assert "Traceback" not in err
    assert "sigdb.toml is damaged or was edited" in err


def test_a_file_that_cannot_be_written_is_exit_code_3(leave, folder, tmp_path):
    (tmp_path / "file").write_text("")
    code, out, err = leave("query", folder / "signatures", "select 1", "--out", tmp_path / "file" / "x.csv")
    assert (code, out) == (3, "")
    (line,) = err.splitlines()
    assert str(tmp_path / "file" / "x.csv") in line


def test_a_reader_that_leaves_early_is_no_error(shell, folder):
    sql = "select a.*, b.id as other from cases a cross join cases b cross join range(5)"  # far more than a pipe holds
    line = '"$0" -m sigdb query "$1" "$2" --format csv | head -1 > /dev/null; echo "${PIPESTATUS[@]}"'
    done = shell(sys.executable, folder / "signatures", sql, command=["bash", "-c", line])
    assert (done.stdout, done.stderr) == ("0 0\n", "")


@pytest.mark.parametrize("arguments", [["query", "{db}", "select 1 as one"], ["--help"]])
def test_a_reader_that_never_reads_is_no_error(shell, folder, arguments):
    reader = subprocess.Popen(["true"], stdin=subprocess.PIPE)
    reader.wait()
    done = shell(
        *(one.format(db=folder / "signatures") for one in arguments),
        capture_output=False,
        stdout=reader.stdin,
        stderr=subprocess.PIPE,
    )
    reader.stdin.close()
    assert (done.returncode, done.stderr) == (0, "")
