"""Facts above a table of numbers: sampling rate, speed, and lines of a keyword and its value."""

import math
import re
from dataclasses import dataclass

from sigdb.core import Note
from sigdb.recording.files.formats.rate_names import INTERVALS, RATES, plain_name
from sigdb.recording.files.formats.stated_rates import RATE_UNITS
from sigdb.recording.files.formats.text.fields import CLOCKS, GROUPED, NUMBER, is_count, kind_of
from sigdb.recording.files.formats.text.units import bare_unit, is_unit, name_and_unit
from sigdb.recording.files.time_names import seconds_of

_RATES_WITH_UNIT = {"rate", "sampling", "abtastung"}
_INTERVALS_WITH_UNIT = {"interval", "increment"}
"""Names that state a sampling rate or an interval where a unit of one follows."""
_SPEEDS = re.compile(r"(shaft|rotor|rotational|rotation|motor|input|nominal|mean)?(speed|rpm|drehzahl|speedrpm)")
_NOT_OF_THE_DATA = re.compile(r"filter|cut-?off|high-?pass|low-?pass|line|carrier|signal|max|min|band|bit|baud|heart")
_KEYWORDS = re.compile(
    r"(file|test|record|recording|recorder|project|device|instrument|sensor|serial|model|firmware|software|version|"
    r"operator|user|author|company|comment|remark|notes?|title|location|machine|rig|trigger|probe|coupling|range|gain|"
    r"offset|sensitivity|scale|number|no|nr|num|count|points?|samples?|lines|length|duration|start|stop|end|begin|date|"
    r"created|exported|saved|measured|channels?|columns|horizontal|vertical|waveform|source|format|separator|decimal|"
    r"delimiter|encoding|job|id|name of|measurement|messung|datum|datei|uhrzeit|startzeit|kommentar|pr[uü]fling|"
    r"bediener|anzahl|kanal|kan[aä]le|zero index|type|filter|window|average|mode|bandwidth|time ?zone|"
    r"elapsed)\b.*",
    re.IGNORECASE,
)
_SETTINGS = re.compile(
    r"(source|model|waveform type|(vertical|horizontal) .*|firmware.*|serial.*|instrument.*|device.*|operator|file.*|"
    r"project.*|trigger.*|probe.*|coupling|record length|created.*|software.*|version.*)",
    re.IGNORECASE,
)
_AXIS = re.compile(r"x|t|x[- ]?axis|time.*|zeit.*|temps|tiempo|tempo", re.IGNORECASE)
_PAIR = re.compile(r"\s*([^\W\d_][^:=\t]{0,79}?)\s*(?::(?!\\)|=)\s*(.*)")
_VALUE = re.compile(
    r"(?:[A-Za-z]{2,12}:)?\s*([+-]?[0-9][0-9.,'\u2019]*(?:[eE][+-]?[0-9]+)?|[+-]?[.,][0-9]+)\s*(.{0,24})"
)
_UNIT_AT_END = re.compile(r"_(hz|khz|s|sec|ms|us)\s*$", re.IGNORECASE)
_SAME = 1e-6
_DOUBTFUL = 1e-4
"""Relative rounding of an interval from which on a note states it."""


@dataclass(frozen=True, kw_only=True)
class Fact:
    """A keyword of a header, and its values as text."""

    key: str
    values: tuple[str, ...]
    line: int


@dataclass(frozen=True, kw_only=True)
class StatedFacts:
    """Sampling rate in Hz, the keyword that states it, speed in rev/min, lines that were used, and notes."""

    sampling_rate: float | None
    rate_from: str
    speed_rpm: float | None
    used: frozenset[int]
    notes: tuple[Note, ...]


def facts_of(text: str, fields: list[str], *, line: int, decimal: str, columns: int) -> list[Fact]:
    """Return the facts that a line of a header states; none for a line of names or units.

    Parameters
    ----------
    text, fields
        The line without comment marks, and its fields.
    line
        Its number.
    decimal
        Decimal sign of the table.
    columns
        Number of columns of the table.
    """
    present = [field for field in fields if field]
    if not present:
        return []
    pairs = [_PAIR.fullmatch(field) for field in present]
    same_width = len(fields) == columns
    if len(present) > 1 and all(pairs) and not (same_width and _are_numbered_names(pairs)):
        return [Fact(key=pair[1], values=(pair[2],), line=line) for pair in pairs if pair]
    key, rest = present[0].rstrip(":= ").strip(), present[1:]
    if rest and present[0].rstrip().endswith((":", "=")) and not (same_width and columns > 2 and _are_words(rest)):
        return [Fact(key=key, values=tuple(rest), line=line)]
    whole = pairs[0] if len(present) == 1 else None
    rate = pairs[0] is not None and _names_a_rate(pairs[0][1])
    if (rate or not same_width) and _reads_as_pair(text):
        whole = whole or _PAIR.fullmatch(text)
    if whole and not is_unit(present[0]):
        return [Fact(key=whole[1], values=(whole[2],), line=line)]
    if rest and _is_fact(key, rest, decimal, same_width=same_width):
        return [Fact(key=key, values=tuple(rest), line=line)]
    return []


def _are_numbered_names(pairs: list[re.Match[str] | None]) -> bool:
    """Return whether pairs are names with numbers, such as "Unnamed: 0"."""
    return all(pair is not None and is_count(pair[2]) and not _names_a_rate(pair[1]) for pair in pairs)


def _reads_as_pair(text: str) -> bool:
    pair = _PAIR.fullmatch(text)
    return pair is not None and "," not in pair[1] and ";" not in pair[1]


def _are_words(fields: list[str]) -> bool:
    return all(kind_of(field, ".") not in NUMBER + GROUPED + CLOCKS for field in fields)


def _is_fact(key: str, values: list[str], decimal: str, *, same_width: bool) -> bool:
    """Return whether a keyword and values are a fact, and no names of columns."""
    if not any(sign.isalpha() for sign in key) or kind_of(key, decimal) in CLOCKS:
        return False
    value = values[0]
    number = kind_of(value, decimal) in NUMBER + GROUPED + CLOCKS or _VALUE.fullmatch(value) is not None
    if number and (_word(key) in RATES | INTERVALS | _RATES_WITH_UNIT | _INTERVALS_WITH_UNIT):
        return True
    if same_width and number and values[1:] and all(map(is_unit, values[1:])):
        return True
    if same_width:
        numeric = [kind_of(field, decimal) in NUMBER + GROUPED + CLOCKS for field in values]
        counts = all(field.isdigit() for field in values) and (len(values) > 1 or _AXIS.fullmatch(key) is not None)
        return (all(numeric) and not counts) or (
            len(values) == 1
            and _KEYWORDS.fullmatch(key) is not None
            and (number or not _may_be_name(value) or _SETTINGS.fullmatch(key) is not None)
        )
    return len(values) <= 2 and (number or _KEYWORDS.fullmatch(key) is not None)


def _may_be_name(value: str) -> bool:
    return len(value) <= 40 and not is_unit(value)


def _word(key: str) -> str:
    """Return a keyword in small letters without its unit, blanks and marks."""
    key = re.sub(r"[\[(][^\])]*[\])]", "", name_and_unit(key)[0]).strip()
    whole = plain_name(key)
    return whole if whole in RATES | INTERVALS else plain_name(_UNIT_AT_END.sub("", key))


def stated_facts(facts: list[Fact], *, decimal: str) -> StatedFacts:
    """Return the sampling rate and the speed that facts state; none where they contradict each other."""
    rates: list[tuple[float, Fact]] = []
    speeds: list[tuple[float, Fact]] = []
    unclear: list[Fact] = []
    for fact in facts:
        stated = [_rate(fact.key, value, fact.values[i + 1 :], decimal) for i, value in enumerate(fact.values)]
        rates += [(rate, fact) for rate in stated if rate]
        if not any(stated) and _names_a_rate(fact.key) and any(_VALUE.fullmatch(value) for value in fact.values):
            unclear.append(fact)
        speed = _speed(fact, decimal)
        speeds += [(speed, fact)] if speed else []
    notes = [_not_taken(fact) for fact in unclear]
    distinct = sorted({float(f"{rate:.7g}") for rate, _ in rates})
    if len(distinct) > 1 and distinct[-1] - distinct[0] > _SAME * distinct[-1]:
        names = ", ".join(dict.fromkeys(fact.key for _, fact in rates))
        text = f"{names} state different sampling rates, so none was taken"
        notes.append(Note(code="different-rates", text=text))
        rates = []
    notes += [_rounded(fact, rate, decimal) for rate, fact in rates[:1] if _rounding(fact, rate, decimal) > _DOUBTFUL]
    one_speed = len({speed for speed, _ in speeds}) == 1
    return StatedFacts(
        sampling_rate=rates[0][0] if rates else None,
        rate_from=rates[0][1].key if rates else "the file",
        speed_rpm=speeds[0][0] if one_speed else None,
        used=frozenset(fact.line for _, fact in [*rates, *(speeds if one_speed else [])]),
        notes=tuple(notes),
    )


def _names_a_rate(key: str) -> bool:
    word = _word(key)
    return word in RATES | _RATES_WITH_UNIT and _NOT_OF_THE_DATA.search(word) is None


def _rate(key: str, value: str, following: tuple[str, ...], decimal: str) -> float | None:
    """Return the rate in Hz that a keyword and its value state."""
    word, match = _word(key), _VALUE.fullmatch(value.strip())
    if match is None or _NOT_OF_THE_DATA.search(word):
        return None
    number = _number(match[1], decimal)
    unit = _unit(key, match[2], following, word)
    if number is None or not number > 0 or unit is None:
        return None
    seconds = seconds_of(unit)
    if seconds is not None and word in (INTERVALS | _INTERVALS_WITH_UNIT if unit else INTERVALS):
        return 1 / (number * seconds)
    if (word in RATES and not unit) or (word in RATES | _RATES_WITH_UNIT and unit in RATE_UNITS):
        return number * RATE_UNITS.get(unit, 1.0)
    return None


def _unit(key: str, behind: str, following: tuple[str, ...], word: str) -> str | None:
    """Return the unit of a value, in small letters: behind it, in the next field or in the keyword."""
    behind = bare_unit(behind.strip(" ,;"))
    if behind:
        return _known_unit(behind)
    if following and _known_unit(bare_unit(following[0])):
        return _known_unit(bare_unit(following[0]))
    suffix = None if word == plain_name(key) else _UNIT_AT_END.search(key)
    inside = name_and_unit(key)[1] or (suffix[1] if suffix else "")
    if inside:
        return _known_unit(inside)
    return "sps" if word.startswith("samplespersec") else ""


def _known_unit(unit: str) -> str | None:
    """Return the unit in small letters; MS/s are not ms."""
    small = unit.strip().lower()
    return small if small in RATE_UNITS or (small and seconds_of(small) is not None) else None


def _number(text: str, decimal: str) -> float | None:
    """Return the number that a text states with either decimal sign; None if it may be two numbers."""
    text = text.replace("'", "").replace("\u2019", "")
    other = "," if decimal == "." else "."
    if decimal in text and other in text:
        first = min(text.index(decimal), text.index(other))
        decimal = decimal if text[first] == other else other
    elif other in text and decimal not in text:
        if re.fullmatch(r"[1-9][0-9]{0,2}[.,][0-9]{3}", text):
            return None
        decimal = other
    plain = text.replace("," if decimal == "." else ".", "").replace(decimal, ".")
    try:
        number = float(plain)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _speed(fact: Fact, decimal: str) -> float | None:
    """Return the speed in rev/min that a fact states."""
    match = _VALUE.fullmatch(fact.values[0].strip()) if fact.values else None
    word = _word(fact.key)
    if match is None or not _SPEEDS.fullmatch(word):
        return None
    second = fact.values[1] if len(fact.values) > 1 else ""
    unit = bare_unit(match[2] or second or name_and_unit(fact.key)[1]).lower()
    number = _number(match[1], decimal)
    stated = unit in ("rpm", "rev/min", "r/min", "1/min", "u/min", "min-1") or (not unit and "rpm" in word)
    return number if stated and number and number > 0 else None


def _not_taken(fact: Fact) -> Note:
    shown = ", ".join(fact.values)[:40]
    text = f"line {fact.line + 1}, {fact.key}: {shown!r} is not certain as a sampling rate, and was not taken"
    return Note(code="rate-not-taken", text=text, values={"line": fact.line + 1})


def _rounding(fact: Fact, rate: float, decimal: str) -> float:
    """Return the relative rounding of an interval; 0 where it gives a whole rate, which rounding hardly does."""
    match = _VALUE.fullmatch(fact.values[0].strip())
    number = _number(match[1], decimal) if match else None
    if match is None or not number or _word(fact.key) not in INTERVALS | _INTERVALS_WITH_UNIT:
        return 0.0
    mantissa, _, exponent = match[1].lower().partition("e")
    digits = len(re.split("[.,]", mantissa)[-1]) if re.search("[.,]", mantissa) else 0
    whole = math.isclose(rate, round(rate), rel_tol=1e-9)
    return 0.0 if whole else 0.5 * 10.0 ** (int(exponent or 0) - digits) / number


def _rounded(fact: Fact, rate: float, decimal: str) -> Note:
    share = _rounding(fact, rate, decimal)
    text = (
        f"{fact.key} states the interval {fact.values[0][:20]} with few digits: the rate holds within "
        f"{100 * share:.2g} %; give sampling_rate if it is known"
    )
    return Note(code="rounded-interval", text=text, values={"uncertainty": share})
