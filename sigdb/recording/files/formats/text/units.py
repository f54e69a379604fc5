"""Units as recorders write them: which words are units, and units in the names of columns."""

import re

_PREFIXES = ("", "m", "u", "µ", "μ", "n", "p", "k", "M", "G", "c", "d", "h")
_WITH_PREFIX = (
    "s", "g", "gn", "V", "A", "W", "Hz", "m", "N", "Pa", "J", "C", "F", "H", "T", "Ohm", "ohm", "Ω", "\u2126", "bar",
    "Vrms", "Vpp", "Vpk", "Grms", "EU", "strain", "Nm", "N m", "N*m", "N·m", "N-m", "rad", "Sa", "S", "eps", "ε",
)  # fmt: skip
_PLAIN = {
    # time
    "sec", "secs", "second", "seconds", "sekunde", "sekunden", "sek", "msec", "msecs", "usec", "millisecond",
    "milliseconds", "microsecond", "microseconds", "nanoseconds", "min", "minute", "minutes", "h", "hr", "hour",
    "hours", "day", "days",
    # acceleration, speed, length
    "gs", "g's", "g rms", "g pk", "gal", "ips", "in/s", "in/sec", "inch/s", "ips2", "in/s2", "in/s^2", "ft/s", "ft/s2",
    "ft/s^2", "fps", "in", "inch", "inches", "mil", "mils", "ft", "mph", "km/h", "kmh", "micron", "microns", "meter",
    "metre", "meters", "metres", "m/s/s", "mm/s/s",
    # electricity
    "volt", "volts", "millivolt", "millivolts", "ampere", "amperes", "amp", "amps", "ampère", "watt", "watts", "ohms",
    "v/v", "mv/v", "mv/g", "va", "var", "db", "dbv", "dbm", "dbfs", "db(a)", "dba", "db re 1g",
    # temperature
    "°c", "degc", "deg c", "celsius", "°f", "degf", "deg f", "fahrenheit", "k", "kelvin", "℃", "℉", "grad c",
    # speed of rotation, angle
    "rpm", "r/min", "rev/min", "u/min", "1/min", "min-1", "min^-1", "min⁻¹", "tr/min", "ob/min", "rad/s", "rad/sec",
    "°/s", "deg/s", "deg", "°", "degree", "degrees", "rad", "radian", "radians", "rev", "revs", "revolution",
    "revolutions", "turn", "turns", "rps", "rev/s", "krpm", "cpm", "1/s", "s-1", "s^-1", "orders", "order",
    # force, pressure, torque, mass, flow
    "newton", "newtons", "lb", "lbs", "lbf", "kgf", "kp", "psi", "psig", "psia", "ksi", "pascal", "atm", "mmhg",
    "inhg", "mmwg", "torr", "lbf in", "lb-in", "lb-ft", "ft-lb", "ft lb", "in-lb", "ft·lb", "lbft", "lbin", "kg",
    "l/min", "l/s", "m3/h", "m³/h", "kg/s", "kg/h", "gpm", "n/mm2", "n/mm²", "n/m2", "n/m²", "n/mm",
    # counts and shares
    "count", "counts", "cnt", "cnts", "digit", "digits", "lsb", "bit", "bits", "adc", "raw", "sample", "samples",
    "pulse", "pulses", "p/rev", "ppr", "#", "-", "--", "%", "%rh", "percent", "pct", "‰", "ppm", "dimensionless",
    "s/s", "ks/s", "ms/s", "sa/s", "ksa/s", "msa/s", "sps", "1/sec",
    "none", "n/a", "no unit", "nounit", "unitless", "logic", "bool", "state", "µm/m", "um/m", "μm/m", "mm/m",
    "ustrain", "µε", "με", "microstrain", "µstrain", "mikrostrain", "eu", "unit", "au", "a.u.",
}  # fmt: skip
_RATIOS = re.compile(
    r"((?:[kcdmuµμn]?m)|in|ft|[kcdmuµμn]?[gVNAWJ]|rad|°|deg)\s?"
    r"(?:/|\s?[·*.]\s?)\s?\(?(?:[mµun]?s|sec|min|h|m|mm|N|kN|Pa|bar|g|V)(?:\s?(?:\^|\*\*)?\(?-?[0-9²³⁻¹]{1,2}\)?)?\)?"
    r"|[kcdmuµμn]?m\s?s\s?(?:\^|\*\*)?\(?[-⁻][0-9²¹]\)?"
)
_RMS = re.compile(r"\s?(rms|pk|pk-pk|pp|p-p|peak|0-p|eff)$", re.IGNORECASE)
_BRACKETS = re.compile(r"[\[({<]\s*(.*?)\s*[\])}>]")
_NAME_AND_UNIT = re.compile(r"(.*\S)\s*(?:\[([^\[\]]{0,20})\]|\(([^()]{0,20})\)|\{([^{}]{0,20})\}|<([^<>]{0,20})>)\s*")
_SLASH = re.compile(r"(.*\S)(?:\s+(?:/|in)\s+|\s*,\s+)(\S.{0,19})")
_LAST_WORD = re.compile(r"(.*[^\s,;:/-])[\s,;:-]+(\S+/\S+)")
_LETTERS = {"A", "C", "F", "H", "S", "T"}
"""Units that may letter the channels."""

_NARROW_SLASH = re.compile(r"([^/]*[^/\s])/(.{1,20})")


def is_unit(word: str) -> bool:
    """Return whether a word is a unit.

    Examples
    --------
    >>> [is_unit(word) for word in ("m/s²", "ips", "counts", "Volt", "mV", "left")]
    [True, True, True, True, True, False]
    """
    word = word.strip()
    if not word or len(word) > 20:
        return False
    base = _RMS.sub("", word) or word
    return (
        word.lower() in _PLAIN
        or any(base == prefix + unit for unit in _WITH_PREFIX for prefix in _PREFIXES if base.endswith(unit))
        or _RATIOS.fullmatch(base) is not None
    )


def bare_unit(field: str) -> str:
    """Return a unit without the brackets around it."""
    match = _BRACKETS.fullmatch(field.strip())
    return match[1] if match else field.strip()


def are_units(fields: list[str]) -> bool:
    """Return whether all fields that are not empty are units, or words in brackets."""
    present = [field for field in fields if field]
    if not present:
        return False
    bracketed = [_BRACKETS.fullmatch(field) is not None for field in present]
    return all(is_unit(bare_unit(field)) or inside for field, inside in zip(present, bracketed, strict=True)) and (
        any(is_unit(bare_unit(field)) for field in present) or all(bracketed)
    )


def share_of_units(fields: list[str]) -> float:
    """Return the share of the fields that are units, of those that are not empty."""
    present = [bare_unit(field) for field in fields if field]
    return sum(map(is_unit, present)) / len(present) if present else 0.0


def name_and_unit(name: str) -> tuple[str, str]:
    """Return a name and the unit that stands in it: in brackets, after a slash, a comma or "in", or a quotient.

    Examples
    --------
    >>> name_and_unit("Time (ms)"), name_and_unit("a1 [m/s²]"), name_and_unit("Weg / mm"), name_and_unit("Accel (left)")
    (('Time', 'ms'), ('a1', 'm/s²'), ('Weg', 'mm'), ('Accel (left)', ''))
    >>> name_and_unit("Weg/mm"), name_and_unit("Velocity, mm/s"), name_and_unit("Velocity mm/s")
    (('Weg', 'mm'), ('Velocity', 'mm/s'), ('Velocity', 'mm/s'))
    """
    name = name[:200].strip()
    if is_unit(name):
        return name, ""
    match = _NAME_AND_UNIT.fullmatch(name)
    if match:
        unit = next((group for group in match.groups()[1:] if group is not None), "").strip()
        square = match[2] is not None
        return (match[1].rstrip(" ,;:/-"), unit) if is_unit(unit) or (square and not unit.isdigit()) else (name, "")
    for pattern in (_SLASH, _LAST_WORD, _NARROW_SLASH):
        match = pattern.fullmatch(name)
        letter = match is not None and match[2] in _LETTERS and len(match[1]) > 2
        if match and not letter and is_unit(bare_unit(match[2])) and not match[2].startswith("-"):
            return match[1], bare_unit(match[2])
    return name, ""
