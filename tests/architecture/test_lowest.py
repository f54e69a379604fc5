"""The constraints of `make lowest` are the lower bounds of all dependencies of the suite."""

import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def run(root):
    return subprocess.run(
        [sys.executable, ROOT / "tests" / "checks" / "lowest.py", "--root", root],
        capture_output=True,
        text=True,
        check=False,
    )


def test_each_dependency_is_at_its_lower_bound():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = run(ROOT).stdout.split()
    for requirement in project["dependencies"]:
        assert requirement.replace(">=", "==") in lines
    assert {line.partition("==")[0] for line in lines} >= {"h5py", "distributed", "pytest"}


def test_a_dependency_without_a_lower_bound_alone_is_refused(tmp_path):
    text = '[project]\nname = "p"\ndependencies = ["numpy<3"]\n[project.optional-dependencies]\n'
    extras = ("dask", "delta", "excel", "iceberg", "identify", "readers", "test")
    (tmp_path / "pyproject.toml").write_text(text + "".join(f"{extra} = []\n" for extra in extras))
    done = run(tmp_path)
    assert done.returncode != 0
    assert "'numpy<3' has no lower bound alone" in done.stderr
