"""The name of the distribution, and what messages and pages tell a user to install."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
INSTALL = re.compile(r"pip install ((?:[\w.'\[\],-]+ ?)+)")


def _texts():
    for folder, ends in ((ROOT / "sigdb", "*.py"), (ROOT / "docs", "*.md")):
        for path in sorted(folder.rglob(ends)):
            if not {"_build", "generated"} & set(path.relative_to(ROOT).parts):
                yield path, path.read_text(encoding="utf-8")
    yield ROOT / "README.md", (ROOT / "README.md").read_text(encoding="utf-8")


def test_only_libraries_that_the_project_names_are_installed_by_name():
    listed = [*PROJECT["dependencies"], *(one for extra in PROJECT["optional-dependencies"].values() for one in extra)]
    libraries = {re.match(r"[\w-]+", one)[0] for one in listed} - {PROJECT["name"]}
    named = [(path.name, word) for path, text in _texts() for line in INSTALL.findall(text) for word in line.split()]
    assert {"h5py", "xlrd", "distributed"} <= {word for _, word in named}
    extras = re.compile(r"'([\w-]+)\[[\w,-]+\]'")
    assert [one for one in named if extras.sub(r"\1", one[1]) not in libraries | {"."}] == []


def test_the_distribution_has_another_name_than_the_package():
    assert PROJECT["name"] == "gear-signatures"
    assert PROJECT["scripts"] == {"sigdb": "sigdb.cli:main"}


def test_the_page_installs_on_every_system_without_make():
    page = (ROOT / "docs" / "guide" / "getting_started.md").read_text(encoding="utf-8")
    first = page.split("## Installation")[1].split("## ")[0]
    assert "py -m venv .venv\n.venv\\Scripts\\Activate.ps1\npip install ." in first
    assert "python3 -m venv .venv\nsource .venv/bin/activate\npip install ." in first
    assert "were not run" in first
