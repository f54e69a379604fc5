"""Unit: presets by name in a sweep; damage on either gear of a mesh, averaged over the damaged gear's revolution."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.sweep import run
from sigdb.transmission import ToothDamage

HEAD = '[sweep]\nrig = "nasa-spiral-bevel"\nhealthy = 1\n'
GRID = '[[sweep.grid]]\ntooth = {tooth}\npattern = "{pattern}"\n'
FEW = (
    "\n[measurement]\naverages = {averages}\nsnr_db = 300.0\nindex_error = 0.0\n\n[signature]\nsamples_per_tooth = 32\n"
)
OWN = "[sweep.patterns]\npitted = [{ stiffness_loss = 0.3 }]\n"


def damaged(plan):
    return [case.damage for case in plan.cases() if case.damage.tooth]


def test_a_preset_needs_no_definition_and_is_in_the_column(plan_of):
    plan = plan_of(HEAD + GRID.format(tooth="[2, 5]", pattern="broken"))
    (damage,) = damaged(plan)
    assert damage.each == (ToothDamage(stiffness_loss=0.5),)
    rows = plan.table(0, plan.rows)
    assert rows["pattern"].tolist() == ["", "broken", "broken"]
    assert rows["tooth"].tolist() == [0, 2, 5]


def test_an_own_pattern_of_that_name_goes_before(plan_of):
    (damage,) = damaged(plan_of(HEAD + GRID.format(tooth=1, pattern="pitted") + OWN))
    assert (damage.pattern, damage.each) == ("pitted", (ToothDamage(stiffness_loss=0.3),))


def test_what_a_preset_is_belongs_to_the_hash(plan_of):
    grid = GRID.format(tooth=1, pattern="pitted")
    by_name = plan_of(HEAD + grid)
    written = plan_of(HEAD + grid + "[sweep.patterns]\npitted = [{ stiffness_loss = 0.5, loss_extent = 0.2 }]\n")
    assert by_name.resolved["sweep"]["patterns"].keys() == {"pitted"}
    assert by_name.hash == written.hash
    assert by_name.hash != plan_of(HEAD + grid + OWN).hash


@pytest.mark.parametrize("tooth", ['"all"', "[4, 5]"])
def test_a_worn_gear_is_one_case_wherever_it_begins(plan_of, tooth):
    plan = plan_of(HEAD + GRID.format(tooth=tooth, pattern="worn"))
    rows = plan.table(0, plan.rows)
    assert rows["tooth"].tolist() == [0, 1 if "all" in tooth else 4]
    assert rows["damaged_teeth"].tolist() == [0, 12]


def test_a_worn_gear_follows_a_swept_tooth_count(plan_of):
    plan = plan_of(
        HEAD + GRID.format(tooth=1, pattern="worn") + "pinion.teeth = [11, 13]\n\n[measurement]\naverages = 36"
    )
    assert [one.damaged_teeth for one in damaged(plan)] == [11, 13]


def test_an_unknown_pattern_names_presets_too(plan_of):
    with pytest.raises(InputError, match=r"pattern 'x' is not defined; .* \(known: pitted, broken, worn\)"):
        plan_of(HEAD + GRID.format(tooth=1, pattern="x"))


@pytest.mark.parametrize(
    ("rig", "gear", "teeth", "averages"),
    [
        ("nasa-spiral-bevel", "pinion", 12, 3),
        ("nasa-spiral-bevel", "gear", 36, 1),
        ("two-stage-gearbox", "middle-pinion", 48, 4),
    ],
)
def test_damage_on_either_gear_shows_at_its_own_tooth(plan_of, tmp_path, rig, gear, teeth, averages):
    """Averaged over the damaged gear's revolution, the signal changes from the damaged tooth's pass on."""
    text = HEAD.replace("nasa-spiral-bevel", rig) + f'gear = "{gear}"\n' + GRID.format(tooth=10, pattern="pitted")
    text += FEW.format(averages=averages)
    run(plan_of(text), tmp_path / "db", recipe=text, jobs=1)
    database = sigdb.open(tmp_path / "db")
    rows = database.cases()
    assert rows["status"].tolist() == ["ok", "ok"]
    assert rows["gear"].unique().tolist() == [gear]
    assert rows["shaft"].unique().tolist() == [sigdb.load_transmission(rig).gears[gear].shaft]
    healthy, pitted = database.signals([0, 1])["tsa"].astype(float)
    assert len(pitted) == 32 * teeth
    energy = ((pitted - healthy) ** 2).reshape(teeth, 32).sum(axis=1)
    assert energy[9] > 0.3 * energy.max()
    assert energy[8] < 0.1 * energy[9]
    assert np.argmax(energy) + 1 in (10, 11, 12)
