"""A database, a model, and the ways to run the command line."""

import os
import subprocess
import sys

import pytest
from click.testing import CliRunner
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.cli.main import cli, main
from sigdb.pipeline import load_recipe, train_model
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 4
specimens = 3
healthy = 10

[[sweep.grid]]
tooth = [1, 6, 7]
stiffness_loss = [0.2, 0.4]
phase_shift_deg = [0.0, 1.5]

[measurement]
snr_db = 10.0
index_error = 1e-6

[signature]
sensors = ["pinion-vertical"]

[recognition]
folds = 3
learner = "lda"
"""


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session")
def _trained(tmp_path_factory, few_trees):
    folder = tmp_path_factory.mktemp("cli")
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    database = sigdb.open(folder / "signatures")
    return folder, train_model(database, "location", folder / "location", command="made by a test")


@pytest.fixture(scope="session")
def folder(_trained):
    """A folder with a database, ``signatures``, and a model, ``location``."""
    return _trained[0]


@pytest.fixture(scope="session")
def evaluation(_trained):
    """The evaluation of that model."""
    return _trained[1]


@pytest.fixture(scope="session")
def database(folder):
    return sigdb.open(folder / "signatures")


@pytest.fixture(scope="session")
def invoke():
    """Run a command in this process; an error is the test's."""

    def call(*arguments):
        result = CliRunner().invoke(cli, [str(one) for one in arguments], catch_exceptions=False)
        assert result.exit_code == 0, result.output
        return result

    return call


@pytest.fixture(scope="session")
def shell():
    """Run a command in a process of its own."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    environment.pop("PYTHONUNBUFFERED", None)

    def call(*arguments, command=(sys.executable, "-m", "sigdb"), **options):
        return subprocess.run(
            [*command, *(str(one) for one in arguments)],
            **{"capture_output": True, "text": True, "check": False, "env": environment, "timeout": 60} | options,
        )

    return call


@pytest.fixture
def leave(monkeypatch, capsys):
    """Run ``main`` in this process: its exit code and what it printed, but for kernels that are compiled."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["sigdb", *(str(one) for one in arguments)])
        with pytest.raises(SystemExit) as left:
            main()
        out, err = capsys.readouterr()
        lines = (line for line in err.splitlines(keepends=True) if not line.startswith("sigdb: compiling "))
        return left.value.code, out, "".join(lines)

    return call
