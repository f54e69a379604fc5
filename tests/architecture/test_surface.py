"""Architecture: the public surface, and how little of the machinery it takes to reach it."""

import json
import os
import subprocess
import sys

import pytest

import sigdb

HEAVY = (
    "numpy",
    "scipy",
    "pandas",
    "numba",
    "sklearn",
    "matplotlib",
    "pyarrow",
    "duckdb",
    "pydantic",
    "joblib",
    "skops",
    "rich",
)
NAMES = {
    "add_features": "sigdb.sweep",
    "Damage": "sigdb.transmission",
    "Periodic": "sigdb.dynamics",
    "SigdbError": "sigdb.core",
    "TimeProfile": "sigdb.dynamics",
    "ToothDamage": "sigdb.transmission",
    "Transient": "sigdb.dynamics",
    "load_model": "sigdb.recognition",
    "load_transmission": "sigdb.transmission",
    "march": "sigdb.dynamics",
    "new_rig": "sigdb.transmission",
    "open": "sigdb.database",
    "prepare": "sigdb.dynamics",
    "diagnose": "sigdb.diagnosis",
    "ensemble": "sigdb.dynamics",
    "read_recording": "sigdb.recording",
    "simulate": "sigdb.dynamics",
}


def loaded_by(code):
    """Heavy libraries that a fresh interpreter has loaded after some code."""
    program = f"import json, sys\n{code}\nprint(json.dumps([one for one in {HEAVY!r} if one in sys.modules]))"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "80"}
    )
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    "code",
    [
        "import sigdb",
        "import sigdb; dir(sigdb); sigdb.__version__; sigdb.SigdbError",
        "import sigdb.cli",
        "import sigdb.recognition, sigdb.report, sigdb.pipeline",
        "from click.testing import CliRunner\nfrom sigdb.cli.main import cli\n"
        "assert CliRunner().invoke(cli, ['--help']).exit_code == 0",
        *(
            f"from click.testing import CliRunner\nfrom sigdb.cli.main import cli\n"
            f"assert CliRunner().invoke(cli, [{command!r}, '--help']).exit_code == 0"
            for command in ("train", "query")
        ),
    ],
)
def test_nothing_heavy_is_loaded(code):
    assert loaded_by(code) == []


def test_the_witness_sees_heavy_libraries():
    assert "numpy" in loaded_by("import sigdb; sigdb.load_transmission")


def test_public_names_are_those_of_their_homes():
    for name, home in NAMES.items():
        assert getattr(sigdb, name).__module__.startswith(home)
    assert sigdb.signature.__name__ == "sigdb.signature"
    assert sigdb.recognition.__name__ == "sigdb.recognition"
    assert sigdb.__version__.count(".") == 2


def test_all_names_the_public_surface():
    assert set(sigdb.__all__) == set(NAMES) | {"signature", "recognition", "__version__"}


def test_dir_lists_all_public_names_before_they_are_used():
    code = "import sigdb\nmissing = set(sigdb.__all__) - set(dir(sigdb))\nassert not missing, missing"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="No sigdb attribute nothing"):
        sigdb.nothing  # noqa: B018
    with pytest.raises(ImportError, match=r"cannot import name 'nothing' from 'sigdb\.recognition'"):
        from sigdb.recognition import nothing  # noqa: F401


def test_errors_of_input_are_value_errors_too():
    with pytest.raises(ValueError, match="no built-in rig 'nothing'"):
        sigdb.load_transmission("nothing")
    with pytest.raises(sigdb.SigdbError):
        sigdb.load_transmission("nothing")
