"""Unit: what a wrong file is told - the owner, the key, the rule, the value and the remedy."""

import pytest
from pydantic import Field, model_validator

from sigdb.core.errors import DatabaseError, InputError, SigdbError, UnstableRigError
from sigdb.core.fields import Section, Vector, quantity, unit_of, validated


class Wheel(Section):
    diameter: float = quantity("m", "Diameter.", gt=0)
    spokes: int = quantity("-", "Number of spokes.", ge=3, default=36)
    centre: Vector = quantity("m", "Centre.", default=(0.0, 0.0, 0.0))
    maker: str = Field(default="", description="Maker.")

    @model_validator(mode="after")
    def _round(self) -> "Wheel":
        if self.maker == "square":
            raise ValueError("maker = 'square' makes no wheels; choose another")
        return self


class Cart(Section):
    wheels: dict[str, Wheel] = Field(description="Wheels by name.")
    spare: Wheel | None = None


def test_a_valid_section_holds_what_was_given():
    cart = validated(Cart, {"wheels": {"left": {"diameter": 0.7, "centre": [0, 1, 2]}}}, owner="cart.toml")
    assert cart.wheels["left"].diameter == 0.7
    assert cart.wheels["left"].spokes == 36
    assert cart.wheels["left"].centre == (0.0, 1.0, 2.0)


def test_a_physical_field_takes_texts_with_units_in_lists_too():
    wheel = Wheel(diameter="700 mm", centre=["20 mm", 1.0, "2e-3 m"])
    assert (wheel.diameter, wheel.centre) == (0.7, (0.02, 1.0, 0.002))


@pytest.mark.parametrize(
    ("wheel", "message"),
    [
        (
            {"diametre": 0.7, "diameter": 0.7},
            r"^cart.toml: unknown key wheels\.left\.diametre; did you mean 'diameter'\?$",
        ),
        ({"xyz": 1, "diameter": 0.7}, r"unknown key wheels\.left\.xyz; known: centre, diameter, maker, spokes$"),
        ({}, r"^cart.toml: wheels\.left\.diameter is missing; add it$"),
        ({"diameter": -0.7}, r"^cart.toml: wheels\.left\.diameter = -0\.7 must be greater than 0$"),
        ({"diameter": "big"}, r"wheels\.left\.diameter: 'big' is no number with a unit; a length is needed"),
        ({"diameter": float("nan")}, r"wheels\.left\.diameter = nan must be a finite number"),
        ({"diameter": float("inf")}, r"wheels\.left\.diameter = inf must be a finite number"),
        ({"diameter": 0.7, "spokes": 2}, r"wheels\.left\.spokes = 2 must be greater than or equal to 3"),
        ({"diameter": 0.7, "spokes": 36.0}, r"wheels\.left\.spokes = 36\.0 must be a valid integer"),
        (
            {"diameter": "3 kg"},
            r"^cart.toml: wheels\.left\.diameter: '3 kg' is a mass; a length is needed, such as \"3 mm\"$",
        ),
        ({"diameter": "-3 mm"}, r"^cart.toml: wheels\.left\.diameter = -0\.003 must be greater than 0$"),
        ({"diameter": 0.7, "spokes": "36"}, r"wheels\.left\.spokes = '36' must be a valid integer"),
        ({"diameter": True}, r"wheels\.left\.diameter = True must be a valid number"),
        ({"diameter": 0.7, "centre": [0.0, 1.0]}, r"wheels\.left\.centre\.2 is missing; add it"),
        ({"diameter": 0.7, "maker": "square"}, r"^cart.toml: wheels\.left: maker = 'square' makes no wheels; choose"),
    ],
)
def test_a_broken_rule_is_named_with_key_value_and_remedy(wheel, message):
    with pytest.raises(InputError, match=message):
        validated(Cart, {"wheels": {"left": wheel}}, owner="cart.toml")


def test_every_problem_has_its_own_line_with_the_owner():
    with pytest.raises(InputError) as caught:
        validated(Cart, {"wheels": {"left": {"diameter": -1.0, "spoke": 4}, "right": {}}}, owner="cart.toml")
    lines = str(caught.value).splitlines()
    assert len(lines) == 3
    assert all(line.startswith("cart.toml: ") for line in lines)


def test_an_unknown_key_at_the_top_names_the_nearest():
    with pytest.raises(InputError, match=r"unknown key whels; did you mean 'wheels'\?"):
        validated(Cart, {"wheels": {}, "whels": {}}, owner="cart.toml")


def test_a_section_behind_an_optional_field_is_searched_for_near_keys():
    with pytest.raises(InputError, match=r"unknown key spare\.spoke; did you mean 'spokes'\?"):
        validated(Cart, {"wheels": {}, "spare": {"diameter": 1.0, "spoke": 3}}, owner="cart.toml")


def test_sections_are_frozen():
    with pytest.raises(
        InputError, match=r"^Wheel\.diameter cannot be assigned: its fields do not change; make a new one"
    ):
        Wheel(diameter=1.0).diameter = 2.0


def test_unit_is_read_from_the_field_and_is_a_dash_without_one():
    assert unit_of(Wheel.model_fields["diameter"]) == "m"
    assert unit_of(Wheel.model_fields["maker"]) == "-"


def test_errors_of_input_are_value_errors_and_all_are_sigdb_errors():
    assert issubclass(InputError, ValueError)
    assert all(issubclass(error, SigdbError) for error in (InputError, UnstableRigError, DatabaseError))


def test_items_of_lists_count_from_the_number_that_is_given():
    data = {"wheels": {"left": {"diameter": 1.0, "centre": [0.0, "x", 0.0]}}}
    for first, named in ((0, "centre.1"), (1, "centre.2")):
        with pytest.raises(InputError, match=rf"^cart: wheels\.left\.{named}: 'x' is no number"):
            validated(Cart, data, owner="cart", first=first)
