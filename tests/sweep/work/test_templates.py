"""Unit: templates of a rig point in several parts, and the bank that gives them to rows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sigdb
from sigdb.database import stored_templates
from sigdb.database.store.schema import write_schema
from sigdb.database.store.store import Store
from sigdb.dynamics import Periodic, PeriodicRig
from sigdb.sweep import run
from sigdb.sweep.plan.plan import PART_TEMPLATES
from sigdb.sweep.plan.schema import plan_schema
from sigdb.sweep.work.templates import TemplateReader, make_template_part

RECIPE = (
    "[[sweep.grid]]\ntooth = 1\ndamaged_teeth = 3\nstiffness_loss = {losses}\n"
    '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical", "pinion-housing-vertical"]\n'
)
LOSSES = [round(0.0025 * (i + 1), 4) for i in range(75)]


@pytest.fixture(scope="module")
def plan(plan_of):
    """A healthy template and 75 damaged ones, the greater losses in the second part."""
    return plan_of(RECIPE.format(losses=LOSSES))


@pytest.fixture(scope="module")
def folder(plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("templates") / "signatures"
    run(plan, folder, jobs=1)
    return folder


@pytest.fixture(scope="module")
def templates(folder):
    return sigdb.open(folder).templates().set_index("template")


def test_a_part_says_the_multiplier_of_its_softest_mesh(templates):
    """On this rig a loss of up to a fifth brings it a little closer to instability than none."""
    rig, solver = sigdb.load_transmission("nasa-spiral-bevel"), Periodic(samples_per_tooth=32)

    def multiplier(loss):
        damage = sigdb.Damage(tooth=1, damaged_teeth=3, stiffness_loss=loss) if loss else None
        return sigdb.simulate(rig, damage, solver=solver).floquet_multiplier

    # The healthy template is the first of the first part.
    for part, greatest in ((0, LOSSES[62]), (1, LOSSES[74])):
        found = templates.loc[templates.index // PART_TEMPLATES == part, "floquet_multiplier"]
        assert_allclose(found, max(multiplier(0.0), multiplier(greatest)), rtol=1e-6)
    assert multiplier(LOSSES[74]) > multiplier(LOSSES[62]) + 5e-6 > multiplier(0.0) + 5e-5


def test_a_part_looks_at_its_own_templates_only(plan, plan_of, tmp_path, monkeypatch):
    """The work of the first part is the same whether 12 templates follow it or 62."""
    calls = []
    stiffness = PeriodicRig.mesh_stiffness
    monkeypatch.setattr(PeriodicRig, "mesh_stiffness", lambda rig, damage: calls.append(1) or stiffness(rig, damage))
    counts = []
    for some in (plan, plan_of(RECIPE.format(losses=[*LOSSES, *(round(0.3 + 0.001 * i, 3) for i in range(50))]))):
        calls.clear()
        store = Store.at(tmp_path / str(len(counts)))
        write_schema(plan_schema(some), store)
        make_template_part(some, store, 0)
        counts.append(len(calls))
    assert counts[0] == counts[1]


def test_the_bank_gives_what_is_stored_in_any_order(folder, templates, plan):
    bank = TemplateReader(Store.at(folder), plan.sensors)
    for number in np.random.default_rng(0).permutation(np.repeat(templates.index, 2)):
        found, stored = bank[int(number)], templates.loc[number]
        assert (found.status, found.contact_loss, found.tooth) == ("ok", False, 0 if number == 0 else 1)
        for i, suffix in enumerate(("", "__pinion-housing-vertical")):
            assert_array_equal(found.signals[i], stored["tsa" + suffix])
            assert_array_equal(found.specimen_response[i].ravel(), stored["specimen_response" + suffix])
            assert found.reference_variance[i] == stored["reference_variance" + suffix]
            assert_array_equal(found.compression, stored["compression"])
        assert found.compression_response.shape == (12 * 32, 12)
        assert found.harmonic_response.shape == (2, 12 * 32, 0, 2)


def test_a_sweep_and_a_database_read_the_same_template(folder, plan):
    """Each had a reader of its own, with other shapes and other units."""
    database, reader = sigdb.open(folder), TemplateReader(Store.at(folder), plan.sensors)
    point = dict(zip(("speed_rpm", "torque"), database.templates()[["speed_rpm", "torque"]].iloc[0], strict=True))
    for i, sensor in enumerate(plan.sensors):
        read = stored_templates(database, **point, teeth=12, sensor=sensor, where="template < 3")
        assert [template.case["template"] for template in read] == [0, 1, 2]
        for template in read:
            other = reader[template.case["template"]]
            assert type(template) is type(other)
            assert (template.case, template.status, template.contact_loss) == (other.case, "ok", False)
            for name in ("signals", "specimen_response", "harmonic_response", "reference_variance"):
                assert_array_equal(getattr(template, name), getattr(other, name)[[i]], err_msg=name)
            assert_array_equal(template.orders, other.orders)
            assert template.static_compression == other.static_compression
