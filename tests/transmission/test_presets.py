"""Unit: damage that has a name."""

import pytest

from sigdb.core.errors import InputError
from sigdb.transmission import Damage, ToothDamage
from sigdb.transmission.damage import PRESETS, preset_teeth


def test_a_pitted_and_a_broken_tooth_lose_half_of_their_stiffness():
    """50 % over the first 20 % of the contact, and 50 % over all of it."""
    pitted, broken = (Damage.preset(name, teeth=12, tooth=6) for name in ("pitted", "broken"))
    assert pitted.on_teeth(12) == {6: ToothDamage(stiffness_loss=0.5, loss_extent=0.2)}
    assert broken.on_teeth(12) == {6: ToothDamage(stiffness_loss=0.5)}
    assert (pitted.pattern, pitted.damaged_teeth, broken.pattern) == ("pitted", 1, "broken")


@pytest.mark.parametrize("teeth", [12, 36, 200])
def test_on_a_worn_gear_every_tooth_is_shifted_and_softer(teeth):
    worn = Damage.preset("worn", teeth=teeth, gear="gear")
    on = worn.on_teeth(teeth)
    assert (worn.gear, sorted(on)) == ("gear", list(range(1, teeth + 1)))
    (one,) = set(on.values())
    assert one.shift_in_passes(teeth) == pytest.approx(0.05, rel=1e-12)
    assert 0 < one.stiffness_loss < 0.5


def test_every_preset_is_damage_and_says_what_it_is():
    assert set(PRESETS) == {"pitted", "broken", "worn"}
    for name, text in PRESETS.items():
        assert Damage.preset(name, teeth=12).is_damage
        assert text


def test_an_unknown_preset_is_refused():
    with pytest.raises(InputError, match="no preset 'piitted'; did you mean 'pitted'"):
        preset_teeth("piitted", 12)
    with pytest.raises(InputError, match="no preset 'x'; known: broken, pitted, worn"):
        Damage.preset("x", teeth=12)
