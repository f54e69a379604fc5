"""Unit: what is called with the progress of long work is declared once, and its blocks cover all rows in order."""

import ast
import inspect
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

import sigdb
from sigdb import paper, pipeline, recognition, sweep
from sigdb.core import Progress, blocks, ignore


@cache
def sources():
    """Parsed modules by path."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in Path(sigdb.__file__).parent.rglob("*.py")}


@pytest.mark.parametrize("value", [Progress(stage="rows", done=1, total=2, before=0), "rows"])
def test_by_default_nothing_is_done(value):
    assert ignore(value) is None


@pytest.mark.parametrize(
    "call",
    [
        sweep.run,
        sweep.verify,
        sweep.refine,
        recognition.train,
        pipeline.run_recipe,
        pipeline.train_model,
        paper.paper_claims,
    ],
)
def test_every_long_call_has_the_one_default(call):
    defaults = {name: one.default for name, one in inspect.signature(call).parameters.items() if name.startswith("on_")}
    assert defaults
    assert set(defaults.values()) == {ignore}


def test_the_types_are_declared_in_one_place():
    """Two modules had an ``OnProgress`` of their own, and ten functions a ``lambda`` by default."""
    homes = {
        path.name
        for path, tree in sources().items()
        for statement in tree.body
        if isinstance(statement, ast.Assign | ast.AnnAssign)
        for target in (statement.targets if isinstance(statement, ast.Assign) else [statement.target])
        if isinstance(target, ast.Name) and target.id in ("OnProgress", "OnStep")
    }
    assert homes == {"progress.py"}
    defaults = [
        f"{path}:{default.lineno}"
        for path, tree in sources().items()
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for parameter, default in zip(function.args.kwonlyargs, function.args.kw_defaults, strict=True)
        if isinstance(default, ast.Lambda) and parameter.arg.startswith("on_")
    ]
    assert defaults == []


SIZES = ("AT_ONCE", "BATCH", "BLOCK")


@pytest.mark.parametrize(("count", "size"), [(0, 3), (1, 3), (3, 3), (7, 3), (9, 3)])
def test_blocks_cover_every_row_once_in_order(count, size):
    parts = [range(count)[some] for some in blocks(count, size)]
    assert [row for part in parts for row in part] == list(range(count))
    assert all(len(part) == size for part in parts[:-1])
    assert all(0 < len(part) <= size for part in parts)


def sizes():
    """Package, name, value and documentation of each constant that is a size of blocks."""
    for path, tree in sources().items():
        for statement, after in zip(tree.body, [*tree.body[1:], None], strict=True):
            if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
                name, said = statement.targets[0].id, isinstance(after, ast.Expr)
                if name.endswith(SIZES) and isinstance(statement.value, ast.Constant):
                    yield (
                        path.parent.relative_to(Path(sigdb.__file__).parent).parts[0],
                        name,
                        statement.value.value,
                        said,
                    )


def test_no_size_of_blocks_is_declared_twice_in_a_package_and_each_says_why():
    """There were fourteen, three of them of the same rows."""
    declared = list(sizes())
    assert len(declared) > 5
    assert [(package, name) for package, name, _, said in declared if not said] == []
    assert [
        at for at, times in Counter((package, value) for package, _, value, _ in declared).items() if times > 1
    ] == []


def test_rows_are_cut_into_blocks_in_one_way():
    """No loop over ``range(0, rows, ROWS_AT_ONCE)`` besides that of ``blocks``."""
    loops = [
        f"{path}:{call.lineno}"
        for path, tree in sources().items()
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"
        if len(call.args) == 3 and isinstance(call.args[2], ast.Name) and call.args[2].id.endswith("AT_ONCE")
    ]
    assert loops == []
