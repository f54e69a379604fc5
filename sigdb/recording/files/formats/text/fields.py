"""Fields of a line of text: splitting at separators, and what a field holds."""

import csv
import re
from functools import lru_cache

NUMBER, MISSING, GROUPED, OVERLOAD, DATE, TIME, MOMENT, NOON, FLAG, WORD = "nmkodtzpfw"
"""Kinds of fields: number, missing number, number with marks of thousands, mark of an overload, date, time of day, date
and time, AM or PM, true or false, any other word."""

CLOCKS = DATE + TIME + MOMENT + NOON
"""Kinds of fields that hold a date or a clock time."""

LONGEST_NUMBER = 64
"""Largest number of characters of a number."""

MISSING_WORDS = ("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "-nan", "1.#qnan", "-1.#ind", "1.#ind")
"""Words for a missing number, in small letters."""

MONTHS = (
    "jan(uary)?|feb(ruary)?|mar(ch)?|apr(il)?|may|june?|july?|aug(ust)?|sept?(ember)?|oct(ober)?|nov(ember)?|"
    "dec(ember)?|januar|februar|mär(z)?|mrz|mai|juni?|juli?|okt(ober)?|dez(ember)?"
)
"""Names of months in English and German, as a pattern."""

_NUMBERS = {
    ".": re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eEdD][+-]?[0-9]+)?|[+-]?inf(inity)?", re.IGNORECASE),
    ",": re.compile(r"[+-]?([0-9]+,?[0-9]*|,[0-9]+)([eEdD][+-]?[0-9]+)?|[+-]?inf(inity)?", re.IGNORECASE),
}
_GROUPS = {
    ".": re.compile(r"[+-]?[1-9][0-9]{0,2}([,'\u2019 \u00a0\u202f\u2009])[0-9]{3}(\1[0-9]{3})*(\.[0-9]*)?"),
    ",": re.compile(r"[+-]?[1-9][0-9]{0,2}([.'\u2019 \u00a0\u202f\u2009])[0-9]{3}(\1[0-9]{3})*(,[0-9]*)?"),
}
_OVERLOAD = re.compile(
    r"[+-]?(#+|\*+|-{2,}|∞|o\.?v?\.?l\.?d?|ovr|ovf|over|over[ -]?(flow|range|load(ed)?)|under[ -]?(flow|range)|"
    r"open|clip(ped)?|sat(urated)?|#(num|div/0|value|ref|wert|zahl)!?|1\.#inf|err(or)?|invalid|bad)[!.]?",
    re.IGNORECASE,
)
_FLAGS = {"true", "false", "yes", "no", "on", "off", "wahr", "falsch"}
_DAY = (
    rf"([0-9]{{4}}[-/.][0-9]{{1,2}}[-/.][0-9]{{1,2}}|[0-9]{{1,2}}[-/.][0-9]{{1,2}}[-/.]([0-9]{{4}}|[0-9]{{2}})|"
    rf"[0-9]{{8}}(?=T| )|[0-9]{{1,2}}[-/. ]{{0,2}}({MONTHS})[-/., ]{{0,2}}([0-9]{{4}}|[0-9]{{2}})|"
    rf"({MONTHS})[-/. ]{{1,2}}[0-9]{{1,2}},? [0-9]{{4}})"
)
_ZONE = r"( ?(z|utc|gmt|[+-][0-9]{2}(:?[0-9]{2})?))?"
_DAYS = r"([0-9]{1,4} days? \+?|([0-9]{4}[: ])?[0-9]{3}[: ])?"
_HOUR = (
    r"[0-9]{1,3}:[0-9]{2}(:[0-9]{2}([.,][0-9]{1,9}|:[0-9]{3})?|[.,][0-9]{1,9})?( ?[ap]\.?m\.?)?" + _ZONE
)  # fmt: skip
_DATE = re.compile(_DAY, re.IGNORECASE)
_TIME = re.compile(_DAYS + _HOUR, re.IGNORECASE)
_MOMENT = re.compile(rf"{_DAY}(T|_|,? {{1,2}}|-|:)([0-9]{{6}}([.,][0-9]{{1,9}})?{_ZONE}|{_HOUR})", re.IGNORECASE)
_NOON = re.compile(r"[ap]\.?m\.?", re.IGNORECASE)


def split(line: str, separator: str) -> list[str]:
    """Return the fields of a line without the blanks and quotes around them; a run of blanks is one separator.

    Examples
    --------
    >>> split('"a, left", 2', ","), split("  1   2 ", " "), split("'a1 [g]';'a2 [g]'", ";")
    (['a, left', '2'], ['1', '2'], ['a1 [g]', 'a2 [g]'])
    """
    line = line.rstrip("\r\n")
    if '"' in line:
        return _split_quoted(line, separator)
    fields = line.split() if separator == " " else [field.strip() for field in line.split(separator)]
    return [_without_apostrophes(field) for field in fields] if "'" in line else fields


def _without_apostrophes(field: str) -> str:
    """Return a field without single quotes around it."""
    return field[1:-1].strip() if len(field) > 1 and field[0] == field[-1] == "'" else field


def _split_quoted(line: str, separator: str) -> list[str]:
    """Return the fields of a line with quotes, within which separators are plain characters."""
    line = line.strip().replace("\t", " ") if separator == " " else line
    try:
        (fields,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
    except (csv.Error, ValueError):
        fields = line.split(separator)
    return [field.strip().strip('"').strip() for field in fields]


@lru_cache(maxsize=4096)
def kind_of(field: str, decimal: str) -> str:
    """Return the kind of a field.

    Examples
    --------
    >>> [kind_of(field, ".") for field in ("1.5e3", "", "OVLD", "10:00:05.5", "2024-03-01", "rig 7")]
    ['n', 'm', 'o', 't', 'd', 'w']
    """
    if len(field) > LONGEST_NUMBER:
        return WORD
    if _NUMBERS[decimal].fullmatch(field):
        return NUMBER
    word = field.lower()
    if word in MISSING_WORDS:
        return MISSING
    if word in _FLAGS:
        return FLAG
    for kind, pattern in (
        (GROUPED, _GROUPS[decimal]), (TIME, _TIME), (DATE, _DATE), (MOMENT, _MOMENT), (NOON, _NOON),
        (OVERLOAD, _OVERLOAD),
    ):  # fmt: skip
        if pattern.fullmatch(field):
            return kind
    return WORD


def kinds_of(fields: list[str], decimal: str) -> str:
    """Return the kinds of fields, a letter for each."""
    return "".join(kind_of(field, decimal) for field in fields)


def is_count(field: str) -> bool:
    """Return whether a field is a plain whole number, which may number a channel."""
    return field.isascii() and field.isdigit() and len(field) <= 4
