"""``sigdb assess``: the verdict on rows of a database, by prevalence and costs."""

import json

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.recognition import Costs, load_model


def answered(invoke, folder, *options):
    result = invoke(
        "assess", folder / "location", folder / "signatures", "--where", "id < 40", "--format", "json", *options
    )
    return json.loads(result.stdout)


def test_its_rows_are_the_verdicts_of_the_model(invoke, folder, database):
    rows = answered(invoke, folder, "--prevalence", "0.02", "--miss-cost", "10")
    model = load_model(folder / "location")
    expected = model.assess(database.features("id < 40").set_index("id"), prevalence=0.02, costs=Costs(miss=10))
    assert [row["id"] for row in rows] == expected.index.tolist()
    for name in ("answer", "reason", "outside"):
        assert [row[name] for row in rows] == expected[name].tolist()
    np.testing.assert_allclose([row["probability"] for row in rows], expected["probability"])
    assert [row["decision"] for row in rows] == expected["decision"].tolist()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--prevalence", "1.5"), "prevalence = 1.5 must be between 0 and 1"),
        (("--miss-cost", "-1"), "costs: miss = -1.0 must be a number of 0 or more"),
        (("--where", "id < 0"), "has no row with a result where id < 0"),
    ],
)
def test_what_it_cannot_answer_by_is_refused(invoke, folder, options, said):
    with pytest.raises(InputError, match=said):
        invoke("assess", folder / "location", folder / "signatures", *options)


def test_the_database_of_recordings_needs_no_truth(folder):
    """Only the columns that the model reads are needed."""
    model, database = load_model(folder / "location"), sigdb.open(folder / "signatures")
    rows = database.cases("id < 4").set_index("id")[["teeth", "speed_rpm", "torque", "averages", "scatter"]]
    assert len(model.assess(model.read(database, rows))) == 4
