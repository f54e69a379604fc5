"""Unit: a recipe names how its cases are solved; another solver is another model form."""

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.database import changed_parts, model_form
from sigdb.sweep import plan_from, run, verify

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
healthy = 2
{solver}

[[sweep.grid]]
tooth = [1, 4]
stiffness_loss = [0.3, 0.9]
snr_db = 40.0

[measurement]
index_error = {index_error}

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""


@pytest.fixture
def plan_with(plan_of):
    def plan(solver=None, index_error=0.0):
        line = f'solver = "{solver}"' if solver else ""
        return plan_of(RECIPE.format(solver=line, index_error=index_error))

    return plan


@pytest.fixture
def database_with(plan_with, tmp_path):
    def made(solver, index_error=0.0):
        folder = tmp_path / solver
        run(plan_with(solver, index_error), folder, jobs=1)
        assert verify(folder) == ()
        return sigdb.open(folder)

    return made


def test_the_default_solver_is_left_out_of_the_hash(plan_with):
    usual, named = plan_with(), plan_with("periodic-or-transient")
    assert "solver" not in usual.resolved
    assert usual.hash == named.hash
    assert usual.hash == "dd9bcc90adde3a1bb07671aa3cfdcd9ff7bd50a29548e6866ab8e3f7bb49d4ea"


@pytest.mark.parametrize("solver", ["periodic", "transient"])
def test_another_solver_is_in_the_resolved_recipe_and_made_again_from_it(plan_with, solver):
    usual, other = plan_with(), plan_with(solver)
    assert other.resolved["solver"] == solver
    assert other.hash != usual.hash
    again = plan_from(other.resolved)
    assert (again.hash, again.design.solver) == (other.hash, solver)


def test_a_database_of_another_solver_is_another_model_form(database_with):
    linear, usual = database_with("periodic"), database_with("periodic-or-transient")
    assert changed_parts(model_form(linear.manifest.resolved), usual.manifest.resolved) == ["solver"]


def test_by_the_periodic_solver_a_case_that_loses_contact_has_no_result(database_with):
    templates = database_with("periodic").templates()
    lost = templates["stiffness_loss"] == 0.9
    assert set(templates.loc[~lost, "status"]) == {"ok"}
    assert templates.loc[lost, "status"].str.contains("the mesh loses contact").all()
    assert set(templates.loc[lost, "status_code"]) == {"contact"}
    assert templates.loc[lost, "contact_loss"].all()
    assert (templates.loc[lost, "min_compression"] < 0).all()


def test_by_the_transient_solver_every_case_is_marched(database_with):
    linear, marched = database_with("periodic-or-transient"), database_with("transient")
    both = [database.templates().set_index("template") for database in (linear, marched)]
    assert set(both[1]["status"]) == {"ok"}
    assert both[1]["contact_loss"].tolist() == both[0]["contact_loss"].tolist()
    for number in both[0].index:
        one, other = (np.asarray(templates.loc[number, "tsa"]) for templates in both)
        assert np.abs(one - other).max() < 2e-3 * np.ptp(one)


def test_index_errors_are_refused_where_every_case_is_marched(plan_with):
    with pytest.raises(InputError, match="'transient' marches each case for gears without index errors"):
        plan_with("transient", index_error=2e-6)


def test_harmonic_excitations_leave_marched_cases_without_a_result(plan_of, tmp_path):
    text = RECIPE.format(solver='solver = "transient"', index_error=0.0).replace(
        "snr_db", "pinion.unbalance = 1e-4\nsnr_db"
    )
    run(plan_of(text), tmp_path / "shaken", jobs=1)
    templates = sigdb.open(tmp_path / "shaken").templates()
    kept = templates["stiffness_loss"] < 0.5
    assert templates.loc[kept, "status"].str.contains("leave those out, or sweep.solver").all()
    assert set(templates.loc[kept, "status_code"]) == {"not_turned"}


def test_an_unknown_solver_is_refused(plan_with):
    with pytest.raises(InputError, match=r"solver = 'periodical' is not known; did you mean 'periodic'"):
        plan_with("periodical")
