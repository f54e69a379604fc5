"""Unit: numbers with units, exact to the last bit, and what a wrong one is answered."""

import sys

import pytest

import sigdb
from sigdb.core import InputError
from sigdb.core.units import _KINDS, in_si, in_unit


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("45 N m", "N m", 45.0), ("45Nm", "N m", 45.0), ("45 N·m", "N m", 45.0), ("45 N-m", "N m", 45.0),
        ("0.045 kNm", "N m", 45.0), ("45e3 N mm", "N m", 45.0), ("45000 Nmm", "N m", 45.0), ("4500 Ncm", "N m", 45.0),
        ("2.5mm", "m", 0.0025), ("3.175 mm", "m", 0.003175), ("20 µm", "m", 2e-5), ("20 μm", "m", 2e-5),
        ("20 um", "m", 2e-5), ("1 in", "m", 0.0254), ("-3.5cm", "m", -0.035), (".5 mm", "m", 5e-4),
        ("1480rpm", "rpm", 1480.0), ("1480 1/min", "rpm", 1480.0), ("1480/min", "rpm", 1480.0),
        ("1480 min^-1", "rpm", 1480.0), ("1480 min-1", "rev/min", 1480.0), ("1480 rev/min", "rev/min", 1480.0),
        ("1480 r/min", "rpm", 1480.0), ("1480 U/min", "rpm", 1480.0), ("1480 tr/min", "rpm", 1480.0),
        ("1480 cpm", "rpm", 1480.0), ("25 rps", "rpm", 1500.0), ("25 cps", "Hz", 25.0),
        ("25 Hz", "rpm", 1500.0), ("25 1/s", "rpm", 1500.0), ("9000 deg/s", "rpm", 1500.0),
        ("157.07963267948966 rad/s", "rpm", 1500.0),
        ("12.8kHz", "Hz", 12800.0), ("1500 rpm", "Hz", 25.0),
        ("15deg", "deg", 15.0), ("15°", "deg", 15.0), ("0.25 rev", "deg", 90.0),
        ("1.5707963267948966 rad", "deg", 90.0),
        ("7.8 g/cm^3", "kg/m^3", 7800.0), ("7.85 g/cm3", "kg/m^3", 7850.0), ("7.85 t/m³", "kg/m^3", 7850.0),
        ("210 GPa", "Pa", 2.1e11), ("206000 N/mm^2", "Pa", 2.06e11), ("206000 N/mm**2", "Pa", 2.06e11),
        ("1e8 N/m", "N/m", 1e8), ("12 kN/mm", "N/m", 1.2e7), ("120 N/um", "N/m", 1.2e8),
        ("5 kNm/rad", "N m/rad", 5000.0), ("3.141592653589793 N m/deg", "N m/rad", 180.0),
        ("0.3 N s/mm", "N s/m", 300.0), ("2 N m s/rad", "N m s/rad", 2.0), ("400 kg mm²", "kg m^2", 4e-4),
        ("20 g mm", "kg m", 2e-5), ("250 g", "kg", 0.25), ("4 %", "-", 0.04), ("2 min", "s", 120.0),
    ],
)  # fmt: skip
def test_a_text_is_the_nearest_number_in_the_unit_of_its_field(text, unit, number):
    assert in_unit(text, unit) == number


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("3 kg", "m", "'3 kg' is a mass; a length is needed, such as \"3 mm\""),
        ("5kW", "N m", "'5kW' is a power; a torque is needed, such as \"45 N m\""),
        (
            "33 lb-ft",
            "N m",
            "'33 lb-ft' is an unbalance; a torque is needed, such as \"45 N m\"; "
            "a pound or a kilogram as a force is lbf or kgf",
        ),
        (
            "5 kg",
            "N",
            "'5 kg' is a mass; a force is needed, such as \"2 kN\"; a pound or a kilogram as a force is lbf or kgf",
        ),
        ("20 °C", "m", "'20 °C' is a temperature; a length is needed, such as \"3 mm\""),
        ("20 degF", "rpm", "'20 degF' is a temperature; a speed of rotation is needed, such as \"1480 rpm\""),
        ("5 N m", "N m/rad", "'5 N m' is a torque; a torsional stiffness is needed, such as \"5 kN m/rad\""),
        ("5 m^4", "m", "'5 m^4' is in m^4; a length is needed, such as \"3 mm\""),
        ("45 NM", "N m", "'45 NM' has the unknown unit 'NM'; did you mean 'Nm'?"),
        ("3 furlong", "m", "'3 furlong' has the unknown unit 'furlong'; a length is needed, such as \"3 mm\""),
        ("2,5 mm", "m", "'2,5 mm' has a comma; write a decimal point, and no mark between thousands"),
        ("1,480 rpm", "rpm", "'1,480 rpm' has a comma; write a decimal point, and no mark between thousands"),
        ("big", "m", "'big' is no number with a unit; a length is needed, such as \"3 mm\""),
        ("nan m", "m", "'nan m' is no number with a unit; a length is needed, such as \"3 mm\""),
        ("1e400 m", "m", "'1e400 m' is too large; a length is needed, such as \"3 mm\""),
        (
            "20",
            "m",
            "'20' has no unit; give the bare number in m without quotes, or a unit: a length is needed, such as "
            '"3 mm"',
        ),
    ],
)
def test_a_text_of_another_kind_is_refused_with_what_it_is_and_what_is_needed(text, unit, message):
    with pytest.raises(InputError) as raised:
        in_unit(text, unit)
    assert str(raised.value) == message


@pytest.mark.parametrize(
    "text",
    ["9**9**9**9 m", "1 m^9^9^9", "1e99999999999 m", "3 __import__('os')", "3 m^0", "3 mm)(", "0x10 m", "1_0 m", "5 Em",
     "3 m 4", "3 [length]", "3 m\x00", "3 " + "m" * 9999, ""],
)  # fmt: skip
def test_no_text_is_evaluated(text):
    with pytest.raises(InputError):
        in_unit(text, "m")


@pytest.mark.parametrize("unit", [unit for unit, (_, example) in _KINDS.items() if example])
def test_the_example_of_a_kind_is_of_that_kind(unit):
    assert in_unit(_KINDS[unit][1], unit) > 0


def test_lists_are_read_at_any_depth_and_other_values_stay():
    assert in_si(["1 kN/mm", 2.0, ("3 N/um",)], "N/m") == [1e6, 2.0, [3e6]]
    assert in_si([["1 mm", "2 deg"], [3.0, 4.0]], (("m", "deg"), ("m", "deg"))) == [[0.001, 2.0], [3.0, 4.0]]
    rows = (1.0, 2)
    assert in_si(rows, "N/m") is rows
    assert in_si("trapezoid", "-") == "trapezoid"
    assert in_si("19/48", "-") == "19/48"


def test_no_unit_no_pint(monkeypatch):
    monkeypatch.setitem(sys.modules, "pint", None)  # its import fails now
    in_unit.__globals__["_registry"].cache_clear()
    assert sigdb.load_transmission("spur-test-rig").operating.speed_rpm > 0
    with pytest.raises(ImportError):
        in_unit("45 N m", "N m")
