"""Unit: what is called with the progress of long work is declared once, and does nothing by default."""

import ast
import inspect
from pathlib import Path

import pytest

import sigdb
from sigdb import paper, pipeline, recognition, sweep
from sigdb.core import Progress, ignore

SOURCES = {path: ast.parse(path.read_text(encoding="utf-8")) for path in Path(sigdb.__file__).parent.rglob("*.py")}


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
        for path, tree in SOURCES.items()
        for statement in tree.body
        if isinstance(statement, ast.Assign | ast.AnnAssign)
        for target in (statement.targets if isinstance(statement, ast.Assign) else [statement.target])
        if isinstance(target, ast.Name) and target.id in ("OnProgress", "OnStep")
    }
    assert homes == {"progress.py"}
    defaults = [
        f"{path}:{default.lineno}"
        for path, tree in SOURCES.items()
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for parameter, default in zip(function.args.kwonlyargs, function.args.kw_defaults, strict=True)
        if isinstance(default, ast.Lambda) and parameter.arg.startswith("on_")
    ]
    assert defaults == []
