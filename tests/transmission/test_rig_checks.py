"""Unit: a wrong rig file is refused with its name, the key, the value and what to do."""

import re
from pathlib import Path

import pytest
from pydantic import BaseModel

from sigdb.core.errors import InputError
from sigdb.core.fields import unit_of
from sigdb.core.units import PHYSICAL
from sigdb.transmission import Transmission, coupled_modes, load_transmission, modal_system

FILE = Path(__file__).parents[2] / "data" / "transmissions" / "nasa_spiral_bevel.toml"
ASSUMED = re.compile(r"^assumed\..*\n|^\[\[meshes\.main\.assumed\.(.+\n)+", re.MULTILINE)
NASA = ASSUMED.sub("", FILE.read_text(encoding="utf-8"))
"""The rig without assumptions, which would refuse other numbers before their own rules do."""
PINION = 'shaft = "pinion-shaft"\nnode = 0'


@pytest.fixture
def changed(tmp_path):
    """Write the NASA rig with pieces of text replaced once each, and load it."""

    def load(*changes):
        text = NASA
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "changed.toml"
        path.write_text(text, encoding="utf-8")
        return load_transmission(path)

    return load


def test_the_unchanged_file_loads(changed):
    assert changed().name == "nasa-spiral-bevel"


def test_a_rig_file_in_other_units_is_the_same_rig(changed):
    in_si = changed()
    other = changed(
        ("speed_rpm = 14400.0", 'speed_rpm = "240 Hz"'),
        ("density = 7800.0", 'density = "7.8 g/cm^3"'),
        ("young_modulus = 2.07e11", 'young_modulus = "207 GPa"'),
        ("length = 0.280", 'length = "280 mm"'),
        ("face_width = 0.0254", 'face_width = "1 in"'),
    )
    assert other == in_si


def units_of(annotation):
    """Yield the unit of each field below a section."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        for field in annotation.model_fields.values():
            yield unit_of(field)
            yield from units_of(field.annotation)
    for part in getattr(annotation, "__args__", ()):
        yield from units_of(part)


def test_every_physical_field_of_a_rig_takes_texts_with_units():
    assert {unit for unit in units_of(Transmission) if unit not in PHYSICAL} == {"pass", "1/rev"}  # counts


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "body_length = 0.038",
            "body_lenght = 0.038",
            "unknown key gears.pinion.body_lenght; did you mean 'body_length'?",
        ),
        ("length = 0.280", 'length = "3 kg"', "segments.0.length: '3 kg' is a mass; a length is needed, such as"),
        ("teeth = 12\n", "", "gears.pinion.teeth is missing; add it"),
        (
            'load = "brake"',
            'load = "motor"',
            "operating.load = 'motor' is on the same shaft as operating.drive",
        ),
        (
            'driven = "gear"',
            'driven = "pinion"',
            "meshes.main.driven = 'pinion' is also its driving gear",
        ),
        ("shear_modulus = 7.95e10", "shear_modulus = 2.95e10", "Poisson's ratio of 2.51, outside -1 to 0.5"),
        ("[gears.pinion]", '[gears."pin.ion"]', "name 'pin.ion' in gears.pin.ion must be letters, digits"),
        ('title = "', 'titel = "', "unknown key titel; did you mean 'title'?"),
        ("length = 0.280", "length = -0.280", "shafts.pinion-shaft.segments.0.length = -0.28 must be greater than 0"),
        (
            "length = 0.280",
            "lenght = 0.280",
            "unknown key shafts.pinion-shaft.segments.0.lenght; did you mean 'length'?",
        ),
        ("contact_ratio = 1.3", "contactratio = 1.3", "profile.contactratio; did you mean 'contact_ratio'?"),
        (
            PINION,
            PINION[:-1] + "9",
            "gears.pinion.node = 9 does not exist: shaft 'pinion-shaft' has the nodes 0 to 8; choose",
        ),
        (PINION, PINION[:-1] + "-1", "gears.pinion.node = -1 must be greater than or equal to 0"),
        (
            PINION,
            'shaft = "pinionshaft"\nnode = 0',
            "gears.pinion.shaft = 'pinionshaft' does not exist; known: pinion-shaft",
        ),
        ("teeth = 12", 'teeth = "12"', "gears.pinion.teeth = '12' must be a valid integer"),
        ("teeth = 12", "teeth = 12.0", "gears.pinion.teeth = 12.0 must be a valid integer"),
        ("teeth = 12", "teeth = 4", "gears.pinion.teeth = 4 must be greater than or equal to 5"),
        ("teeth = 12", "teeth = ", "not valid TOML"),
        ("torque = 356.05", "torque = nan", "operating.torque = nan must be a finite number"),
        ("rotation = -1", "rotation = 2", "operating.rotation = 2 must be 1 or -1"),
        ('hand = "left"', 'hand = "lefthand"', "meshes.main.hand = 'lefthand' must be 'right' or 'left'"),
        (
            'sources.teeth = "published: ',
            'sources.teeth = "',
            "gears.pinion: sources.teeth = 'the paper' must begin with",
        ),
        ("sources.teeth =", "sources.tooth =", "gears.pinion: sources.tooth names no field here; name one that"),
        ('apex = "behind"\nbody', "body", "gears.pinion.apex is missing: its shaft meets the other at an angle"),
        (
            'gear = "pinion"',
            'gear = "pinon"',
            "sensors.pinion-vertical.gear = 'pinon' does not exist; known: pinion, gear",
        ),
        (
            'gear = "pinion"',
            'point = "roof"',
            "sensors.pinion-vertical.point = 'roof' does not exist; known: pinion-front",
        ),
        ('gear = "pinion"', "", "sensors.pinion-vertical: give either gear or point"),
        (
            'gear = "pinion"',
            'gear = "pinion"\npoint = "gear-left"',
            "sensors.pinion-vertical: give either gear or point",
        ),
        (
            'quantity = "velocity"',
            'quantity = "speed"',
            "quantity = 'speed' must be 'displacement', 'velocity' or 'acceleration'",
        ),
        (
            "direction = [0.0, 1.0, 0.0]",
            "direction = [0, 0, 0]",
            "direction = [0, 0, 0] has no direction; give for example",
        ),
        ('seat = "gear-left"', 'seat = "roof"', "bearings.gear-left.seat = 'roof' does not exist; known: pinion-front"),
        ("flank = 0.45", "flank = 0.7", "flank = 0.7 must be at most half of contact_ratio = 1.3"),
        (
            "bore = 0.055",
            "bore = 0.2",
            "gears.gear.bore = 0.2 must be less than the mean pitch diameter 0.1538; reduce",
        ),
        (
            "face_width = 0.0254",
            "face_width = 0.2",
            "face_width = 0.2 is too wide for the pitch cones of 'pinion' and 'gear'",
        ),
        (
            "elements = 8",
            "elements = 8\ninner_diameter = 0.058",
            "inner_diameter = 0.058 must be less than outer_diameter",
        ),
        ("elements = 8", "elements = 0", "segments.0.elements = 0 must be greater than or equal to 1"),
        ("axis = [1.0, 0.0, 0.0]", "axis = [0, 0, 0]", "shafts.gear-shaft: axis = [0, 0, 0] has no direction; give"),
        ("axis = [1.0, 0.0, 0.0]", "axis = [1.0, 0.0]", "shafts.gear-shaft.axis.2 is missing"),
        (
            "axis = [1.0, 0.0, 0.0]",
            "axis = [0.0, 0.0, 1.0]",
            "the shafts of 'pinion' and 'gear' are parallel; give the mesh's line",
        ),
        ("shape.gear-left = [0.0, 0.4, 0.0]\n", "", "give every mode's shape at the same points"),
        (
            "stiffness = [1.7e8",
            "stiffness = [-1.7e8",
            "bearings.gear-left: stiffness = [-170000000.0, 170000000.0, 145000000.0] must not",
        ),
        ('drive = "motor"', 'drive = "engine"', "operating.drive = 'engine' does not exist; known: motor, brake"),
        ('load = "brake"', 'load = "fan"', "operating.load = 'fan' does not exist; known: motor, brake"),
        (
            'material = "steel"',
            'material = "stel"',
            "shafts.pinion-shaft.material = 'stel' does not exist; known: steel",
        ),
        ('driven = "gear"', 'driven = "wheel"', "meshes.main.driven = 'wheel' does not exist; known: pinion, gear"),
        (
            'driving = "pinion"\ndriven = "gear"',
            'driving = "gear"\ndriven = "pinion"',
            "its driving gear's shaft is not driven; power must flow from shaft 'pinion-shaft' through the meshes",
        ),
        ("[gears.pinion]", '[gears."pin.ion"]', "gears.pin.ion"),
    ],
)
def test_a_wrong_entry_is_named_with_file_key_value_and_remedy(changed, old, new, message):
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        changed((old, new))
    assert all("changed.toml: " in line for line in str(caught.value).splitlines())


def test_all_problems_of_a_file_come_at_once(changed):
    with pytest.raises(InputError) as caught:
        changed(
            (PINION, PINION[:-1] + "20"), ('seat = "gear-left"', 'seat = "roof"'), ('load = "brake"', 'load = "fan"')
        )
    assert len(str(caught.value).splitlines()) == 3


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"absent\.toml: no such file"):
        load_transmission(tmp_path / "absent.toml")


def test_parallel_gears_need_a_line_of_centres_across_their_shafts(changed):
    turned = ("axis = [1.0, 0.0, 0.0]", "axis = [0.0, 0.0, 1.0]")
    changed(turned, ('hand = "left"', 'hand = "left"\nline_of_centres = [1.0, 0.0, 0.0]'))
    with pytest.raises(InputError, match=r"line_of_centres = \[0\.0, 0\.0, 1\.0\] lies along the shafts"):
        changed(turned, ('hand = "left"', 'hand = "left"\nline_of_centres = [0, 0, 1]'))


@pytest.mark.parametrize("solve", [modal_system, coupled_modes])
def test_a_shaft_without_axial_stiffness_can_move_freely(changed, solve):
    soft = ("1.1e8, 1.1e8, 9.4e7", "1.1e8, 1.1e8, 0.0")
    rig = changed(soft, soft)
    with pytest.raises(
        InputError, match=r"'nasa-spiral-bevel': pinion-shaft axial can move freely; hold it with a bearing"
    ):
        solve(rig)


def test_a_shaft_held_against_motion_across_itself_only_at_one_bearing_can_still_turn_about_it(changed):
    soft = ("stiffness = [1.7e8, 1.7e8, 1.45e8]", "stiffness = [0.0, 0.0, 1.45e8]")
    rig = changed(soft, soft)
    with pytest.raises(InputError, match=r"gear-shaft bending can move freely"):
        modal_system(rig)


def test_a_wrong_item_of_a_list_is_reported_alone(changed):
    with pytest.raises(InputError) as error:
        changed(("length = 0.280", "length = -0.280"))
    assert len(str(error.value).splitlines()) == 1


def test_a_load_on_a_shaft_that_no_mesh_drives_is_refused(changed):
    idle = """
[shafts.idle]
axis = [1.0, 0.0, 0.0]
material = "steel"
segments = [{ length = 0.1, outer_diameter = 0.02 }]

[couplings.brake]
shaft = "idle"
"""
    with pytest.raises(InputError, match=r"operating\.load = 'brake' is on shaft 'idle', which no mesh drives"):
        changed(('[couplings.brake]\nshaft = "gear-shaft"\nnode = 8', idle + "node = 1"))


def test_ranges_take_texts_with_units_of_their_field(changed):
    end = 'sources.inertia = "'
    ranged = changed((end, f'assumed.inertia = {{ low = "10 kg cm^2", high = "1 kg m^2", scale = "log" }}\n{end}'))
    inertia = next(coupling.assumed["inertia"] for coupling in ranged.couplings.values() if coupling.assumed)
    assert (inertia.low, inertia.high) == (0.001, 1.0)
    with pytest.raises(InputError, match=r"assumed: '3 mm' is a length; a moment of inertia is needed"):
        changed((end, f'assumed.inertia = {{ low = "3 mm", high = 1.0 }}\n{end}'))
