"""Architecture: layers point downwards only, read from the source with no tool but the parser."""

import ast
import importlib
import inspect
from functools import cache
from pathlib import Path

import pytest

import sigdb

ROOT = Path(sigdb.__file__).parent
LAYERS = {
    name: height
    for height, names in enumerate(
        [
            ["core"],
            ["transmission"],
            ["signature", "measurement", "dynamics", "prognosis"],
            ["database"],
            ["identification"],
            ["recognition", "sweep", "recording", "paper", "loaders"],
            ["ingest"],
            ["diagnosis", "planning"],
            ["monitoring"],
            ["report"],
            ["pipeline"],
            ["explorer", "public_sets"],
            ["cli"],
        ]
    )
    for name in names
}
MODULES = {
    ".".join(("sigdb", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__"): path
    for path in sorted(ROOT.rglob("*.py"))
}
THE_EXCEPTION = "sigdb.sweep.__main__"


def layer(module):
    return module.split(".")[1] if module.count(".") else ""


def statements(body):
    """Yield all statements of a body, also of blocks in it, but not those under ``if TYPE_CHECKING``."""
    for node in body:
        yield node
        if not (isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            yield from statements(getattr(node, "body", ()))
        for block in ("orelse", "finalbody", "handlers", "cases"):
            yield from statements(getattr(node, block, ()))


def imports(path):
    """Names that a file imports, when it is loaded or in a function, and those that its stub imports."""
    found = set()
    for node in statements(ast.parse(path.read_text(encoding="utf-8")).body):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    stub = path.with_suffix(".pyi")
    if stub.exists():
        package = ".".join(("sigdb", *path.parent.relative_to(ROOT).parts))
        for node in ast.walk(ast.parse(stub.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                home = f"{package}.{node.module}" if node.module else package
                found |= {f"{home}.{alias.name}" for alias in node.names}
    return found


@cache
def all_imports():
    """Names that each module imports."""
    return {module: imports(path) for module, path in MODULES.items()}


@cache
def edges():
    """Pairs of a module and a name of sigdb that it imports."""
    return [
        (module, name)
        for module, names in all_imports().items()
        for name in sorted(names)
        if name.startswith("sigdb.") and layer(module) in LAYERS and module != THE_EXCEPTION
    ]


def importers_of(package):
    return {module for module, names in all_imports().items() if any(name.split(".")[0] == package for name in names)}


def test_every_package_has_its_layer():
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert packages == set(LAYERS)
    assert {path.name for path in ROOT.glob("*.py")} == {"__init__.py", "__main__.py"}


def test_the_imports_were_found():
    assert len(edges()) > 100
    assert "sigdb.database.open" in all_imports()["sigdb.cli.commands.query"]  # in a function
    assert "sigdb.recognition.training.train" in all_imports()["sigdb.recognition"]  # lazily
    assert "pandas" not in all_imports()["sigdb.cli.commands.query"]  # for types only


def test_layers_point_downwards_only():
    upwards = [
        f"{module} imports {name}"
        for module, name in edges()
        if layer(name) != layer(module) and layer(name) in LAYERS and LAYERS[layer(name)] >= LAYERS[layer(module)]
    ]
    assert upwards == []


def test_no_layer_imports_the_top_level():
    assert [edge for edge in edges() if layer(edge[1]) not in LAYERS] == []
    assert [module for module, names in all_imports().items() if "sigdb" in names] == []


@pytest.mark.parametrize(
    ("package", "forbidden"),
    [
        ("signature", {"transmission", "dynamics", "measurement"}),
        ("measurement", {"transmission", "dynamics", "signature"}),
        ("recognition", {"dynamics", "sweep"}),
    ],
)
def test_what_a_layer_must_not_know(package, forbidden):
    known = [
        f"{module} imports {name}" for module, name in edges() if layer(module) == package and layer(name) in forbidden
    ]
    assert known == []


def test_signature_and_measurement_reach_no_rig_by_way_of_others():
    reached, todo = set(), [module for module in MODULES if layer(module) in ("signature", "measurement")]
    while todo:
        module = todo.pop()
        if module in reached:
            continue
        reached.add(module)
        for name in all_imports()[module]:
            todo += [one for one in (name, name.rpartition(".")[0]) if one in MODULES and one != "sigdb"]
    assert {layer(module) for module in reached} == {"signature", "measurement", "core"}


def test_the_command_of_the_sweep_only_calls_the_command_line():
    assert all_imports()[THE_EXCEPTION] == {"sigdb.cli.main", "sigdb.cli.commands.sweep.sweep"}


@pytest.mark.parametrize(
    ("library", "layers"),
    [
        ("matplotlib", {"report"}),
        ("sklearn", {"database", "recognition"}),
        ("skops", {"recognition"}),
        ("duckdb", {"database"}),
        ("click", {"cli"}),
        ("jinja2", {"report"}),
        ("rich", {"cli", "report"}),  # progress; tables of text
    ],
)
def test_a_library_has_one_home(library, layers):
    assert {layer(module) for module in importers_of(library)} == layers


def test_no_name_of_a_lazy_face_is_that_of_a_module():
    """The module would take the name's place as soon as it is imported."""
    for package in sorted(set(LAYERS)):
        stub = ROOT / package / "__init__.pyi"
        if stub.exists():
            names = {name.rpartition(".")[2] for name in all_imports()[f"sigdb.{package}"] if name.startswith("sigdb.")}
            inside = {path.stem for path in (ROOT / package).iterdir()} - {"__init__"}
            assert names & inside == set()


def test_no_pickle_is_read_or_written():
    assert importers_of("pickle") | importers_of("cloudpickle") | importers_of("dill") == set()


def test_files_are_named_after_what_they_hold():
    vague = {"utils", "util", "common", "helpers", "helper", "misc", "tools", "functions", "base"}
    assert [str(path) for path in MODULES.values() if {path.stem, path.parent.name} & vague] == []


def test_no_module_is_long():
    lengths = {module: len(path.read_text(encoding="utf-8").splitlines()) for module, path in MODULES.items()}
    assert {module: n for module, n in lengths.items() if n > 400} == {}


def public():
    for module in MODULES:
        if module.endswith("__main__"):
            continue
        loaded = importlib.import_module(module)
        for name in getattr(loaded, "__all__", ()):
            yield module, name, getattr(loaded, name)


def test_every_public_name_says_what_it_is():
    named = list(public())
    assert len(named) > 50
    silent = [
        f"{module}.{name}"
        for module, name, value in named
        if (inspect.isclass(value) or callable(value)) and not (value.__doc__ or "").strip()
    ]
    assert silent == []


def test_every_module_says_what_it_holds():
    assert [
        module for module, path in MODULES.items() if not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ] == []
