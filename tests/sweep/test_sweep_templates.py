"""Unit: templates of a rig point in several parts, and the bank that gives them to rows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sigdb
from sigdb.database.storage import Store
from sigdb.dynamics import Periodic, PeriodicRig
from sigdb.sweep import run
from sigdb.sweep.bank import TemplateBank
from sigdb.sweep.plan import PART_TEMPLATES
from sigdb.sweep.templates import make_template_part

RECIPE = (
    "[[sweep.grid]]\ntooth = 1\nstiffness_loss = {losses}\nphase_shift_deg = [0.0, 1.5]\n"
    '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical", "pinion-housing-vertical"]\n'
)
LOSSES = [round(0.01 * (i + 1), 2) for i in range(40)]


@pytest.fixture(scope="module")
def plan(plan_of):
    """A healthy template and 80 damaged ones, the greater losses in the second part."""
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
    rig, solver = sigdb.load_transmission("nasa-spiral-bevel"), Periodic(samples_per_tooth=32)
    healthy = sigdb.simulate(rig, solver=solver).floquet_multiplier
    parts = [templates[templates.index // PART_TEMPLATES == part] for part in (0, 1)]
    found = [part["floquet_multiplier"].unique() for part in parts]
    for part, multipliers in zip(parts, found, strict=True):
        losses = part[part["stiffness_loss"] == part["stiffness_loss"].max()]
        damaged = [
            sigdb.simulate(
                rig,
                sigdb.Damage(tooth=1, stiffness_loss=row.stiffness_loss, phase_shift_deg=row.phase_shift_deg),
                solver=solver,
            ).floquet_multiplier
            for row in losses.itertuples()
        ]
        # The shift moves the mesh's stiffness and changes its mean by rounding only, so either may be the softest.
        assert any(np.allclose(multipliers, max(healthy, one), rtol=1e-6) for one in damaged)
    assert len(parts[1]) == 81 - 64


def test_a_part_looks_at_its_own_templates_only(plan, plan_of, tmp_path, monkeypatch):
    """The work of the first part is the same whether one template follows it or 96."""
    calls = []
    stiffness = PeriodicRig.mesh_stiffness
    monkeypatch.setattr(PeriodicRig, "mesh_stiffness", lambda rig, damage: calls.append(1) or stiffness(rig, damage))
    counts = []
    for some in (plan, plan_of(RECIPE.format(losses=[*LOSSES, *(round(0.5 + 0.01 * i, 2) for i in range(40))]))):
        calls.clear()
        make_template_part(some, Store.at(tmp_path / str(len(counts))), 0)
        counts.append(len(calls))
    assert counts[0] == counts[1]


def test_the_bank_gives_what_is_stored_in_any_order(folder, templates, plan):
    bank = TemplateBank(Store.at(folder), plan.sensors)
    for number in np.random.default_rng(0).permutation(np.repeat(templates.index, 2)):
        found, stored = bank[int(number)], templates.loc[number]
        assert (found.status, found.contact_loss, found.tooth) == ("ok", False, 0 if number == 0 else 1)
        for i, suffix in enumerate(("", "__pinion-housing-vertical")):
            assert_array_equal(found.signals[i], stored["tsa" + suffix])
            assert_array_equal(found.specimen_response[i].ravel(), stored["specimen_response" + suffix])
            assert found.reference_variance[i] == stored["reference_variance" + suffix]
        assert_allclose(found.compression * stored["static_compression"], stored["compression"], rtol=1e-12)
        assert found.compression_response.shape == (12 * 32, 12)
        assert found.harmonic_response.shape == (2, 12 * 32, 0, 2)
