"""Architecture: no function, class, constant or field is there for nothing, or for tests only."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import sigdb


@cache
def trees() -> dict[Path, ast.Module]:
    """Parsed modules by path."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in Path(sigdb.__file__).parent.rglob("*.py")}


COMPARED = {"face_load": "with published values", "force_per_torque": "with the balance of moments"}
"""Fields that nothing but a comparison reads, which shows that their neighbours are right."""


@cache
def public() -> set[str]:
    """Names for users, which nothing in sigdb needs to use."""
    return {
        name.value
        for path, tree in trees().items()
        if path.name == "__init__.py"
        for statement in tree.body
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "__all__"
        for name in ast.walk(statement.value)
        if isinstance(name, ast.Constant)
    }


@cache
def used() -> set[str]:
    """Names that are read, imported, or in a text that is no docstring (``getattr``, tables of names)."""
    names: set[str] = set()
    for path, tree in trees().items():
        for node in ast.walk(tree):
            match node:
                case ast.Name(id=name, ctx=ast.Load()) | ast.Attribute(attr=name, ctx=ast.Load()):
                    names.add(name)
                case ast.Constant(value=str(text)) if text.replace(".", "").isidentifier():
                    names.add(text.rpartition(".")[2])
                case ast.ImportFrom(names=imported) if path.name != "__init__.py":
                    names |= {alias.name for alias in imported}
    return names


def imported_by_scripts() -> set[str]:
    """Names that two scripts import, behind `make paper` and `make paper-search`."""
    scripts = (Path(__file__).parents[2] / "benchmarks").glob("paper_*.py")
    nodes = (node for path in scripts for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    return {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names}


def defined() -> Iterator[tuple[str, str]]:
    """Names of functions, classes and constants of modules, with their places."""
    for path, tree in trees().items():
        for statement in tree.body:
            match statement:
                case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.Assign(targets=[ast.Name(id=name)]):
                    if not (path.parent.name == "commands" and name == path.stem):  # read by its name
                        yield name, f"{path}:{statement.lineno}: {name}"


def fields() -> Iterator[tuple[str, str]]:
    """Names of fields of dataclasses that no user has, with their places."""
    names = public()
    for path, tree in trees().items():
        for owner in ast.walk(tree):
            if (
                isinstance(owner, ast.ClassDef)
                and owner.name not in names
                and "dataclass" in map(_decorator, owner.decorator_list)
            ):
                for statement in owner.body:
                    if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
                        yield statement.target.id, f"{path}:{statement.lineno}: {owner.name}.{statement.target.id}"


def _decorator(node: ast.expr) -> str:
    return ast.unparse(node.func if isinstance(node, ast.Call) else node)


def test_everything_that_a_module_defines_is_public_or_used():
    known = public() | used() | imported_by_scripts()
    assert [place for name, place in defined() if name not in known and not name.startswith("__")] == []


def test_every_field_of_an_internal_dataclass_is_read():
    known = used() | set(COMPARED)
    assert [place for name, place in fields() if name not in known] == []
