"""Numbers written with a unit, such as "2.5 mm" or "45 N m": read by pint, which is imported when the first one is met.

The units are those of machines, few enough to be listed here, and each in one sense: in pint's own list ``Nm`` is one
over the unit of yarn. The angle has a dimension of its own, so that speeds of rotation and frequencies differ from
rates in radians by 2 pi, as they should. Numbers are decimal until the last step, so that "3.175 mm" is 0.003175 m.
"""

import re
from collections.abc import Sequence
from decimal import Decimal
from functools import lru_cache
from itertools import chain, repeat
from typing import TYPE_CHECKING

from sigdb.core.errors import InputError

if TYPE_CHECKING:
    from pint import Unit, UnitRegistry

_DEFINITIONS = """
nano- = 1e-9 = n-
micro- = 1e-6 = u- = µ- = μ-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
deci- = 1e-1 = d-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m = metre
gram = [mass] = g
second = [time] = s = sec
radian = [angle] = rad
kelvin = [temperature] = K = degC = degF
degree = 3.1415926535897932384626433832795028841971693993751 / 180 * radian = deg = °
turn = 360 * degree = rev = revolution = r = U = tr
minute = 60 * second = min
hour = 3600 * second = h
tonne = 1000 * kilogram = t
newton = kilogram * meter / second ** 2 = N
newton_meter = newton * meter = Nm
newton_centimeter = newton * centimeter = Ncm
newton_millimeter = newton * millimeter = Nmm
pascal = newton / meter ** 2 = Pa
bar = 1e5 * pascal
watt = newton * meter / second = W
hertz = turn / second = Hz
rpm = turn / minute = RPM = cpm
rps = turn / second = cps
inch = 0.0254 * meter = in
foot = 12 * inch = ft
mil = 1e-3 * inch = thou
pound = 0.45359237 * kilogram = lb
ounce = pound / 16 = oz
pound_force = 4.4482216152605 * newton = lbf
kilogram_force = 9.80665 * newton = kgf = kp
psi = pound_force / inch ** 2
percent = 0.01 = %
"""

_KINDS: dict[str, tuple[str, str]] = {
    "-": ("a number without a unit", "4 %"),
    "m": ("a length", "3 mm"),
    "kg": ("a mass", "250 g"),
    "s": ("a time", "20 ms"),
    "deg": ("an angle", "15 deg"),
    "K": ("a temperature", ""),
    "Hz": ("a frequency", "12.8 kHz"),
    "rpm": ("a speed of rotation", "1480 rpm"),
    "m/s": ("a velocity", "3 mm/s"),
    "m/s^2": ("an acceleration", "9.81 m/s^2"),
    "N": ("a force", "2 kN"),
    "W": ("a power", "5 kW"),
    "N m": ("a torque", "45 N m"),
    "N/m": ("a stiffness", "120 N/um"),
    "N m/rad": ("a torsional stiffness", "5 kN m/rad"),
    "N s/m": ("a damping", "300 N s/m"),
    "N m s/rad": ("a torsional damping", "2 N m s/rad"),
    "kg m": ("an unbalance", "20 g mm"),
    "kg m^2": ("a moment of inertia", "400 kg mm^2"),
    "kg/m^3": ("a density", "7.85 g/cm^3"),
    "Pa": ("a pressure or a modulus", "210 GPa"),
}
"""Units of fields with a physical kind and an example of it."""
_SAME = {"rev/min": "rpm"}
PHYSICAL = frozenset({*_KINDS, *_SAME})
"""Units of fields that take texts with units."""


class QuantityError(InputError):
    """A text is no number with a unit of the kind that is needed.

    Attributes
    ----------
    place
        Indices of the text in the lists that hold it.
    """

    place: tuple[int, ...] = ()


_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)(?![\d.,])\s*(.*?)\s*", re.DOTALL)
_PERCENT = re.compile(r"\s*[+-]?[\d.,]+\s*%\s*")
_COMMA = re.compile(r"\s*[+-]?\d+,\d")
_WORD = r"[^\W\d_]+|[°%]|°C|°F"
_UNIT = re.compile(rf"(?:1?\s*/)?\s*(?:(?:{_WORD}|\^-?[1-4]|[*/]|[()])\s*)+")
_LONGEST = 60


def in_si(value: object, unit: str | Sequence[str | Sequence[str]]) -> object:
    """Return a value of a field whose texts with units, also in lists, are numbers in the unit of the field.

    A ratio takes a text in % only, and its other texts stay as they are. Items of a list may have units of their own.

    Raises
    ------
    QuantityError
        If a text is no number with a unit, or of another kind; it knows its place in the lists.
    """
    if isinstance(value, str) and isinstance(unit, str):
        return value if unit == "-" and not _PERCENT.fullmatch(value) else in_unit(value, unit)
    if isinstance(value, list | tuple) and any(isinstance(item, str | list | tuple) for item in value):
        units = repeat(unit) if isinstance(unit, str) else chain(unit, repeat(unit[-1]))
        return [_item_in_si(item, item_unit, i) for i, (item, item_unit) in enumerate(zip(value, units, strict=False))]
    return value


def _item_in_si(item: object, unit: str | Sequence[str], index: int) -> object:
    try:
        return in_si(item, unit)
    except QuantityError as error:
        error.place = (index, *error.place)
        raise


def in_unit(text: str, unit: str) -> float:
    """Return the number of a text with a unit, in another unit of the same kind.

    Parameters
    ----------
    text : str
        A number and its unit, such as ``"2.5mm"``, ``"45 N m"``, ``"1480 rpm"``, ``"7.8 g/cm^3"`` or ``"12 kN/mm"``.
        ``1/min`` and ``1/s`` count revolutions or cycles.
    unit : str
        Unit of the result, as a field declares it.

    Returns
    -------
    float

    Raises
    ------
    QuantityError
        If the text is no number with a unit, or is of another kind; the message has the text and what is needed.

    Examples
    --------
    >>> in_unit("2.5mm", "m"), in_unit("1480 rpm", "rpm"), in_unit("25 Hz", "rpm")
    (0.0025, 1480.0, 1500.0)
    """
    unit = _SAME.get(unit, unit)
    kind, example = _KINDS.get(unit, (f"a number in {unit}", f"1 {unit}"))
    needed = f'{kind} is needed, such as "{example}"'
    shown = repr(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}...")
    if _COMMA.match(text):
        raise QuantityError(f"{shown} has a comma; write a decimal point, and no mark between thousands")
    parts = _NUMBER.fullmatch(text)
    if parts is None or len(text) > _LONGEST:
        raise QuantityError(f"{shown} is no number with a unit; {needed}")
    number, written = parts.groups()
    if not written:
        raise QuantityError(f"{shown} has no unit; give the bare number in {unit} without quotes, or a unit: {needed}")
    registry, parsed, wanted = _registry(), _unit(written), _declared(unit)
    if parsed is None:
        unknown = next((word for word in re.findall(_WORD, written) if _unit(word) is None), written)
        near = next((name for name in _COMMON if name.lower() == unknown.lower()), None)
        remedy = needed if near is None else f"did you mean {near!r}?"
        raise QuantityError(f"{shown} has the unknown unit {unknown!r}; {remedy}")
    if parsed.dimensionality == {"[time]": -1} and wanted.dimensionality == _declared("Hz").dimensionality:
        parsed = parsed * registry.Unit("turn")
    if parsed.dimensionality != wanted.dimensionality:
        alike = (
            name for other, (name, _) in _KINDS.items() if _declared(other).dimensionality == parsed.dimensionality
        )
        actual = next(alike, f"in {written}")
        as_weight = parsed.dimensionality * _declared("m/s^2").dimensionality == wanted.dimensionality
        weight = "; a pound or a kilogram as a force is lbf or kgf" if as_weight else ""
        raise QuantityError(f"{shown} is {actual}; {needed}{weight}")
    value = float(registry.Quantity(Decimal(number), parsed).to(wanted).magnitude)
    if abs(value) == float("inf"):
        raise QuantityError(f"{shown} is too large; {needed}")
    return value


def separate_quantities(text: str) -> list[str]:
    """Return the numbers of a text, each with its unit: they are separated by commas that are not within a number.

    Examples
    --------
    >>> separate_quantities("2.5mm,3 mm"), separate_quantities("2,5 mm")
    (['2.5mm', '3 mm'], ['2,5 mm'])
    """
    return re.split(r"(?<=[^\d\s])\s*,\s*|,\s+", text)


_COMMON = ("mm", "um", "cm", "kg", "Nm", "N", "kN", "kNm", "rpm", "Hz", "kHz", "deg", "rad", "GPa", "MPa", "Pa", "kW")
"""Units that are often written with other capitals."""


def _declared(unit: str) -> "Unit":
    """Return the unit of a field."""
    declared = _unit(unit)
    assert declared is not None, unit
    return declared


@lru_cache(maxsize=256)
def _unit(written: str) -> "Unit | None":
    """Return a unit as pint knows it; None for one that it does not know."""
    text = written.replace("²", "^2").replace("³", "^3").replace("⁴", "^4").replace("**", "^")
    text = re.sub(r"[·⋅.]|(?<=[^\W\d_])-(?=[^\W\d_])", "*", text)  # N-m and N.m are products
    text = re.sub(r"(?<=[^\W\d_])(?=-?[1-4](?!\d))", "^", text).replace("°C", "degC").replace("°F", "degF")
    if written == "-":
        return _registry().Unit("")
    if not _UNIT.fullmatch(text):
        return None
    text = f"1{text.lstrip()}" if text.lstrip().startswith("/") else text
    try:
        return _registry().parse_units(text)
    except Exception:  # pint: PintError, TokenError, AssertionError and TypeError, by what it cannot read
        return None


@lru_cache(maxsize=1)
def _registry() -> "UnitRegistry[Decimal]":
    from pint import UnitRegistry  # slow to load, and needed only where a text has a unit

    registry: UnitRegistry[Decimal] = UnitRegistry(None, non_int_type=Decimal, cache_folder=None)
    registry.load_definitions(_DEFINITIONS.splitlines())
    return registry
