"""The reference is complete: commands, public names, sections; and no link leads nowhere."""

import importlib
import re
from pathlib import Path

import click
import pytest
from pydantic import BaseModel

import sigdb
from sigdb.cli.main import cli
from sigdb.pipeline.recipe import RecipeSections
from sigdb.signature import INDICATORS
from sigdb.transmission import Transmission

DOCS = Path(__file__).parents[2] / "docs"
REFERENCE = DOCS / "reference"
PAGES = [path for path in sorted(DOCS.rglob("*.md")) if not {"_build", "generated"} & set(path.relative_to(DOCS).parts)]
PACKAGES = [
    f"sigdb.{layer}"
    for layer in (
        "core",
        "transmission",
        "dynamics",
        "identification",
        "signature",
        "measurement",
        "database",
        "sweep",
        "recognition",
        "loaders",
        "recording",
        "explorer",
        "ingest",
        "public_sets",
        "diagnosis",
        "monitoring",
        "planning",
        "prognosis",
        "paper",
        "pipeline",
        "report",
    )
]
DIRECTIVE = re.compile(r"^\.\. auto(?:function|class|exception|data):: (\S+)", re.MULTILINE)
LINK = re.compile(r"\]\(([^)#\s]*)(#[^)\s]*)?\)")
DRAWN = {"healthy.png", "damaged.png", *(f"figure-{number}.png" for number in (4, 5, 6, 8, 9))}


def _text(name):
    return (REFERENCE / name).read_text(encoding="utf-8")


def _sections(model):
    """A section and all that its fields hold."""
    found, waiting = [], [model]
    while waiting:
        here = waiting.pop()
        if isinstance(here, type) and issubclass(here, BaseModel):
            if here not in found:
                found.append(here)
                waiting += [field.annotation for field in here.model_fields.values()]
        else:
            waiting += getattr(here, "__args__", ())
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_of_a_layer_is_documented_once(package):
    documented = DIRECTIVE.findall(_text(f"{package.removeprefix('sigdb.')}.md"))
    public = [f"{package}.{name}" for name in importlib.import_module(package).__all__]
    assert sorted(documented) == sorted(public)


def test_every_layer_with_public_names_has_a_page():
    inside = [path.parent.name for path in (DOCS.parent / "sigdb").glob("*/__init__.py")]
    assert {f"sigdb.{name}" for name in inside} - {"sigdb.cli"} == set(PACKAGES)


@pytest.mark.parametrize("name", sigdb.__all__)
def test_every_name_of_the_top_level_is_mentioned(name):
    assert f"sigdb.{name}" in _text("sigdb.md")


def test_every_public_error_is_documented():
    errors = importlib.import_module("sigdb.core.errors")
    own = {
        name
        for name, value in vars(errors).items()
        if getattr(value, "__module__", "") == errors.__name__
        and isinstance(value, type)
        and issubclass(value, Exception)
    }
    assert set(DIRECTIVE.findall(_text("sigdb.md"))) == own


def test_every_command_has_its_help_on_the_page():
    shown = re.findall(r"^## sigdb (\S+)\n\n```\{command\} (\S+)$", _text("cli.md"), re.MULTILINE)
    context = click.Context(cli)
    names = cli.list_commands(context)
    assert shown == [(name, name) for name in names]
    assert all(cli.get_command(context, name).help for name in names)


@pytest.mark.parametrize("model", [Transmission, RecipeSections])
def test_every_section_has_a_table_of_fields(model):
    shown = re.findall(r"^```\{fields\} (\S+)$", _text("fields.md"), re.MULTILINE)
    wanted = {f"{section.__module__}.{section.__name__}" for section in _sections(model)}
    assert wanted <= set(shown)


def test_every_table_of_a_database_has_its_columns_on_the_page():
    shown = re.findall(r"^```\{columns\} (\S+) (\S+)$", _text("columns.md"), re.MULTILINE)
    tables = [(recipe == "recordings", table) for recipe, table in shown]
    assert tables == [(False, name) for name in ("features", "signals", "templates")] + [
        (True, name) for name in ("features", "signals")
    ]


def test_every_indicator_is_in_the_table_of_definitions():
    text = (DOCS / "theory" / "signature.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE) == list(INDICATORS)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(DOCS).as_posix())
def test_every_internal_link_leads_to_a_file_and_a_heading(page):
    for target, anchor in LINK.findall(page.read_text(encoding="utf-8")):
        if target.startswith(("http:", "https:", "mailto:")):
            continue
        file = (page.parent / target).resolve() if target else page
        if file.parent == DOCS / "generated":
            assert file.name in DRAWN
            continue
        assert file.is_file(), f"{page.name}: {target}"
        if anchor:
            headings = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor[1:] in {_anchor(heading) for heading in headings}, f"{page.name}: {target}{anchor}"


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(DOCS).as_posix())
def test_every_page_is_reached_from_another(page):
    if page == DOCS / "index.md":
        return
    name, folder = page.stem, page.parent
    entry = f"{folder.name}/index" if name == "index" else name
    index = DOCS / "index.md" if name == "index" else folder / "index.md"
    assert re.search(rf"^{re.escape(entry)}$", index.read_text(encoding="utf-8"), re.MULTILINE)


def _anchor(heading):
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
