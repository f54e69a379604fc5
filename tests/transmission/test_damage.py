"""Unit: what a damage is, on which teeth it lies, and which descriptions contradict themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sigdb.core.errors import InputError
from sigdb.transmission import Damage, ToothDamage

PITTED = ToothDamage(stiffness_loss=0.5, loss_extent=0.2)
BROKEN = ToothDamage(stiffness_loss=0.5)


def test_an_undamaged_gear_has_no_damaged_tooth():
    for healthy in (Damage(), Damage(tooth=0), Damage(tooth=0, damaged_teeth=0)):
        assert (healthy.tooth, healthy.damaged_teeth) == (0, 0)
        assert healthy.on_teeth(12) == {}
        assert not healthy.is_damage


def test_one_tooth_is_damaged_unless_more_are_named():
    damage = Damage(tooth=6, stiffness_loss=0.25)
    assert damage.damaged_teeth == 1
    assert damage.on_teeth(12) == {6: ToothDamage(stiffness_loss=0.25)}


def test_damaged_teeth_wrap_past_the_last():
    teeth = Damage(tooth=12, damaged_teeth=3, phase_shift_deg=1.5).on_teeth(12)
    assert list(teeth) == [12, 1, 2]
    assert set(teeth.values()) == {ToothDamage(phase_shift_deg=1.5)}


def test_all_teeth_can_be_damaged():
    assert sorted(Damage(tooth=5, damaged_teeth=12, stiffness_loss=0.1).on_teeth(12)) == list(range(1, 13))


def test_a_pattern_lays_its_teeth_in_the_order_of_mesh():
    """The paper's Figure 8B: a broken tooth between two pitted ones, here across the tacho mark."""
    damage = Damage(tooth=12, pattern="figure-8B", each=[PITTED, BROKEN, PITTED])
    assert damage.damaged_teeth == 3
    assert damage.on_teeth(12) == {12: PITTED, 1: BROKEN, 2: PITTED}
    assert damage.is_damage


@pytest.mark.parametrize(
    ("damage", "is_damage"),
    [
        (Damage(tooth=3), False),
        (Damage(tooth=3, stiffness_loss=0.5), True),
        (Damage(tooth=3, stiffness_loss=0.5, loss_extent=0.0), False),
        (Damage(tooth=3, loss_extent=0.3), False),
        (Damage(tooth=3, phase_shift_deg=-0.1), True),
        (Damage(tooth=3, each=[ToothDamage(), ToothDamage()]), False),
        (Damage(tooth=3, each=[ToothDamage(), BROKEN]), True),
    ],
)
def test_is_damage_tells_whether_anything_changes(damage, is_damage):
    assert damage.is_damage is is_damage


@given(tooth=st.integers(1, 20), count=st.integers(1, 20))
def test_consecutive_teeth_from_the_first(tooth, count):
    teeth = Damage(tooth=tooth, damaged_teeth=count, stiffness_loss=0.5).on_teeth(20)
    assert len(teeth) == count
    assert list(teeth) == [(tooth - 1 + i) % 20 + 1 for i in range(count)]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"tooth": 3, "damaged_teeth": 0}, "tooth = 3 and damaged_teeth = 0 contradict each other; both are 0"),
        ({"tooth": 0, "damaged_teeth": 2}, "tooth = 0 and damaged_teeth = 2 contradict each other"),
        ({"stiffness_loss": 0.5}, "damage is given without a tooth; say with tooth which tooth"),
        ({"each": [BROKEN]}, "damage is given without a tooth; say with tooth which tooth"),
        ({"tooth": 3, "each": [BROKEN], "loss_extent": 0.2}, "leave out phase_shift_deg, stiffness_loss, loss_extent"),
        ({"phase_shift_deg": 1.0}, "given without a tooth"),
        ({"tooth": 3, "each": [BROKEN], "stiffness_loss": 0.1}, "gives the damage of 1 teeth one by one; leave out"),
        ({"tooth": 3, "each": [BROKEN], "phase_shift_deg": 0.1}, "gives the damage of 1 teeth one by one; leave out"),
        ({"tooth": 3, "each": [BROKEN], "damaged_teeth": 2, "pattern": "x"}, "pattern 'x' gives the damage of 1 teeth"),
        ({"tooth": -1}, "tooth"),
        ({"tooth": 1.0}, "valid integer"),
        ({"tooth": 1, "stiffness_loss": 1.1}, "less than or equal to 1"),
        ({"tooth": 1, "stiffness_loss": -0.1}, "greater than or equal to 0"),
        ({"tooth": 1, "loss_extent": 1.1}, "less than or equal to 1"),
        ({"tooth": 1, "phase_shift_deg": float("inf")}, "finite number"),
        ({"tooth": 1, "phase_shift": 1.0}, "phase_shift"),
    ],
)
def test_a_contradiction_is_a_value_error_that_says_so(given, message):
    with pytest.raises(InputError, match=message):
        Damage(**given)


@pytest.mark.parametrize(
    "given", [{"tooth": 13}, {"tooth": 1, "damaged_teeth": 13}, {"tooth": 1, "each": [BROKEN] * 13}]
)
def test_damage_must_fit_the_gear(given):
    with pytest.raises(
        InputError,
        match=r"tooth \d+ does not exist: the gear has 12 teeth|damaged_teeth = \d+, but the gear has 12 teeth",
    ):
        Damage(**given).on_teeth(12)


def test_numbers_of_numpy_are_taken_as_a_table_gives_them():
    given = {"tooth": np.int32(3), "damaged_teeth": np.int64(2), "stiffness_loss": np.float32(0.5)}
    assert Damage(**given) == Damage(tooth=3, damaged_teeth=2, stiffness_loss=0.5)
    with pytest.raises(InputError, match="tooth"):
        Damage(tooth=np.float64(3.5))
