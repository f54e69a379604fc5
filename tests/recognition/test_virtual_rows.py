"""Unit: a model of virtual rows, and its evaluation, are those of the same rows where they are stored."""

from dataclasses import replace

import pytest

import sigdb
from sigdb.recognition import RecognitionSettings, evaluate, train
from sigdb.sweep import run
from sigdb.sweep.plan.make_plan import plan_from


@pytest.fixture(scope="module")
def virtual(database, tmp_path_factory):
    """The rows of ``database``, of which templates are stored."""
    plan = plan_from(database.manifest.resolved)
    folder = tmp_path_factory.mktemp("virtual") / "signatures"
    run(replace(plan, design=plan.design.model_copy(update={"store": "templates"})), folder, jobs=1)
    with sigdb.open(folder) as opened:
        yield opened


def test_models_and_evaluations_of_virtual_rows_are_those_of_stored_rows(virtual, database, without_boosting):
    """All learners of the target are compared: lda reads features, templates read averages."""
    assert virtual.virtual_rows == len(database)
    assert database.virtual_rows == 0
    settings = RecognitionSettings(folds=3, learner="lda")
    got, due = (evaluate(train(one, "location", settings), one, bound=False) for one in (virtual, database))
    assert (got.rows, got.split_hash, got.learner) == (due.rows, due.split_hash, "lda")
    assert got.metrics == due.metrics
    assert due.metrics["lda"]
    assert due.metrics["templates"]
