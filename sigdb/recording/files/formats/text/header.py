"""Names, units and facts above a table of numbers in a text."""

import re
from collections import Counter
from dataclasses import dataclass, replace
from itertools import pairwise

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.text.facts import Fact, StatedFacts, facts_of, stated_facts
from sigdb.recording.files.formats.text.fields import CLOCKS, FLAG, GROUPED, NUMBER, kind_of, split
from sigdb.recording.files.formats.text.layout import TextLayout
from sigdb.recording.files.formats.text.units import are_units, bare_unit, is_unit, name_and_unit, share_of_units

_COMMENT = re.compile(r"\s*(?:[#%!*]+|//+|--\s|'(?=[^']*$)|;(?=\s*[A-Za-z#%]))\s*")
_RULE = re.compile(r"[\s\-=+*_|#~.,;\"\u2500-\u257f]*")
_LABEL = re.compile(
    r"(channel[ _]?)?(names?|labels?|signals?|titles?|units?|y[ _]?units?|einheit(en)?|bezeichnung|descriptions?|"
    r"comments?|beschreibung|kan[aä]le?|channels?|quantity|eu|axis|direction|sensors?)\s*:?",
    re.IGNORECASE,
)
_UNIT_LABEL = re.compile(r"(channel[ _]?)?(y[ _]?)?(units?|einheit(en)?|unit[eé]s?|eu)\s*:?", re.IGNORECASE)
_TIME_WORD = re.compile(
    r"(?:.*[^a-zäöü])?(t|x|time|times|timestamp|zeit|temps|tiempo|tempo|tid|date|datum|sample|index|x-axis|"
    r"elapsed|seconds?|sec)([^a-zäöü].*)?",
    re.IGNORECASE,
)
_AXES = {"x", "y", "z", "+x", "-x", "+y", "-y", "+z", "-z", "x+", "y+", "z+", "x-", "y-", "z-", "xyz", "scalar", "n/a",
         "-", "rx", "ry", "rz", "s", "none"}  # fmt: skip
_TOKENS = re.compile(r'"[^"]*"|[^\s\[(]+(?:\s?[\[(][^\])]*[\])])?|[\[(][^\])]*[\])]')
_LONGEST_NAME, _MOST_WORDS = 60, 8


@dataclass(frozen=True, kw_only=True)
class TextHeader:
    """Header of a table: names and units of the columns, facts, and notes on lines that were left out.

    ``names`` is None where the header names no columns; a unit is empty where none is stated.
    """

    names: tuple[str, ...] | None
    units: tuple[str, ...]
    facts: StatedFacts
    notes: tuple[Note, ...]


@dataclass(frozen=True, kw_only=True)
class _Line:
    """A line of the header with its fields, split as the table is or otherwise."""

    number: int
    text: str
    fields: tuple[str, ...]
    commented: bool = False


def text_header(lines: list[str], layout: TextLayout, *, side_fields: list[list[str]], row: str) -> TextHeader:
    """Return the names, units and facts in the lines above a table.

    Parameters
    ----------
    lines
        The lines above the first row.
    layout
        Layout of the table.
    side_fields
        Fields of facts that stand in the first columns of rows.
    row
        The first row; if it begins with a name in quotes, as R writes it, that column may have no name.

    Raises
    ------
    InputError
        If the line just above the table names another number of columns.
    """
    labelled = row.lstrip().startswith('"')
    whole = [
        _line(i, text, layout, labelled=labelled)
        for i, text in enumerate(lines)
        if text.strip() and not _is_instruction(text)
    ]
    whole = [line for line in whole if not _RULE.fullmatch(line.text)]
    whole, increments = _without_increments(whole, layout)
    facts: dict[int, list[Fact]] = {}
    for line in whole:
        stated_here = facts_of(
            line.text, list(line.fields), line=line.number, decimal=layout.decimal, columns=layout.columns
        )  # fmt: skip
        if stated_here and not (layout.numbered and line is whole[-1]):
            facts[line.number] = stated_here
    group, below = _group([line for line in whole if line.number not in facts], layout)
    if not group and below is not None:
        _refuse_other_width(below, layout)
    names, units = _names_and_units(group, layout)
    stated = stated_facts(
        [*(fact for some in facts.values() for fact in some), *increments, *_side_facts(side_fields, layout)],
        decimal=layout.decimal,
    )
    used = {line.number for line in group} | stated.used
    left = [line for line in whole if line.number not in used]
    notes = list(stated.notes)
    if left:
        text = f"{len(left)} lines before the table were left out"
        notes.append(Note(code="lines-left-out", text=text, values={"lines": len(left)}))
    return TextHeader(names=names, units=units, facts=stated, notes=tuple(notes))


def _is_instruction(text: str) -> bool:
    return re.fullmatch(r"\s*sep=.\s*", text) is not None


def _line(number: int, text: str, layout: TextLayout, *, labelled: bool) -> _Line:
    """Return a line without its comment mark, split so that it has the fields of the table if it can."""
    comment = _COMMENT.match(text)
    bare = text[comment.end() :] if comment else text if layout.separator == "\t" else text.strip()
    ways = [split(bare, layout.separator)]
    if len(ways[0]) != layout.columns:
        ways += [split(bare, separator) for separator in "\t;," if separator in bare]
        ways += [re.split(r"\s{2,}|\t", bare.strip()), [part.strip() for part in bare.split("|")]]
        if layout.separator == " ":
            ways.append([token.strip('"') for token in _TOKENS.findall(bare)])
    ways.append(split(text.strip(), layout.separator))
    fields = next((way for way in ways if len(way) == layout.columns), None)
    if fields is None and labelled and len(ways[0]) == layout.columns - 1 and bare.startswith('"'):
        fields = ["", *ways[0]]
    fields = fields or next((fit for way in ways if (fit := _fitted(way, layout)) is not None), ways[0])
    return _Line(number=number, text=bare.strip(), fields=tuple(fields), commented=comment is not None)


def _fitted(fields: list[str], layout: TextLayout) -> list[str] | None:
    """Return the fields with as many as the table has columns: empty ones at the end differ, or a label is in front."""
    short = list(fields)
    while short and not short[-1]:
        short.pop()
    missing = layout.columns - len(short)
    empty = len(layout.kinds) - len(layout.kinds.rstrip("m"))
    if 0 <= missing <= empty and len(short) > 1:
        return short + [""] * missing
    if missing == -1 and _LABEL.fullmatch(short[0]) and len(short) > 1:
        return short[1:]
    if missing == 0 and len(short) != len(fields):
        return short
    return None


def _without_increments(lines: list[_Line], layout: TextLayout) -> tuple[list[_Line], list[Fact]]:
    """Return the lines without the columns Start and Increment, whose values stand in the next line, and the facts."""
    for above, line in pairwise(lines):
        words = [field.lower() for field in above.fields]
        if "start" not in words or "increment" not in words:
            continue
        at = words.index("increment")
        values = split(line.text, layout.separator)
        if at >= len(values) or kind_of(values[at], layout.decimal) != NUMBER:
            continue
        dropped = {words.index("start"), at}
        fact = Fact(key="Time increment", values=(values[at],), line=line.number)
        mended = [
            replace(header_line, fields=_resized([x for i, x in enumerate(fields) if i not in dropped], layout.columns))
            for header_line, fields in ((above, above.fields), (line, tuple(values)))
        ]
        by_number = {line.number: line for line in mended}
        return [by_number.get(line.number, line) for line in lines], [fact]
    return lines, []


def _resized(fields: list[str], columns: int) -> tuple[str, ...]:
    while len(fields) > columns and not fields[-1]:
        fields.pop()
    return tuple(fields + [""] * (columns - len(fields)))


def _group(lines: list[_Line], layout: TextLayout) -> tuple[list[_Line], _Line | None]:
    """Return the lines that belong to the columns, from the table upwards, and the lowest line of another width."""
    group: list[_Line] = []
    below: _Line | None = None
    for line in reversed(lines):
        fits = len(line.fields) == layout.columns and any(line.fields) and not _is_free_text(line, layout)
        if layout.numbered and not group:
            fits = len(line.fields) == layout.columns
        if fits:
            group.insert(0, line)
        elif group:
            break
        elif below is None:
            below = line
    return group, below


def _is_free_text(line: _Line, layout: TextLayout) -> bool:
    """Return whether a line is a sentence or a title, where a table has a single column or few names are present."""
    present = [field for field in line.fields if field]
    if layout.columns == 1:
        return len(line.text) > _LONGEST_NAME or len(line.text.split()) >= _MOST_WORDS
    return layout.columns > 2 and len(present) == 1 and present[0] == line.fields[0] and not is_unit(present[0])


def _refuse_other_width(line: _Line, layout: TextLayout) -> None:
    fields = [field for field in line.fields if field]
    if len(fields) > 1 and layout.separator != " " and not line.commented:
        raise InputError(
            f"line {line.number + 1} names {len(fields)} columns, the lines below have {layout.columns} numbers; "
            "mend it, or give separator and decimal"
        )


def _names_and_units(group: list[_Line], layout: TextLayout) -> tuple[tuple[str, ...] | None, tuple[str, ...]]:
    """Return the names and units of columns from the lines that belong to them, in any order."""
    blank = ("",) * layout.columns
    labelled = [len(line.fields) > 1 and _UNIT_LABEL.fullmatch(line.fields[0]) is not None for line in group]
    rows = [_without_label(line.fields, labelled=any(labelled)) for line in group]
    if not rows:
        return None, blank
    unit_rows = [i for i, row in enumerate(rows) if labelled[i] or are_units(list(row))]
    if not unit_rows and len(rows) > 1:
        shares = [share_of_units(list(row)) for row in rows]
        best = max(range(len(rows)), key=lambda i: (shares[i], i))
        unit_rows = [best] if shares[best] >= 0.5 and shares.count(shares[best]) == 1 else []
    others = [i for i in range(len(rows)) if i not in unit_rows]
    if not others:
        top = rows[unit_rows[0]]
        units = rows[unit_rows[-1]]
        return tuple(bare_unit(field) for field in top), tuple(bare_unit(field) for field in units)
    chosen = max(others, key=lambda i: _likeness(rows, i))
    names = rows[chosen]
    if layout.numbered:
        return names, blank
    units = next((rows[i] for i in unit_rows), blank)
    pairs = [name_and_unit(name) for name in names]
    stated = tuple(bare_unit(unit) or inner for unit, (_, inner) in zip(units, pairs, strict=True))
    return tuple(
        name if bare_unit(unit) and not inner else short
        for name, unit, (short, inner) in zip(names, units, pairs, strict=True)
    ), stated


def _without_label(fields: tuple[str, ...], *, labelled: bool) -> tuple[str, ...]:
    """Return the fields of a line without the word in front that states what the line holds, such as "Unit"."""
    if len(fields) > 1 and _LABEL.fullmatch(fields[0]) and (labelled or fields[0].endswith(":")):
        return ("", *fields[1:])
    return fields


def _likeness(rows: list[tuple[str, ...]], i: int) -> tuple[float, int]:
    """Return how much the fields of a line look like names of columns, and the line's place for the case of a tie."""
    row = rows[i]
    present = [field for field in row if field]
    score = 4.0 * any(_TIME_WORD.fullmatch(name_and_unit(field)[0]) for field in row[:2])
    score += 2.0 * (len(set(present)) == len(present)) + 2.0 * (len(present) / len(row))
    score -= 4.0 * all(field.lower() in _AXES for field in present)
    score -= 0.5 * sum(field.count(" ") for field in present) / len(present)
    score -= 2.0 * sum(kind_of(field, ".") in NUMBER + GROUPED + CLOCKS + FLAG for field in present) / len(present)
    most = Counter(present).most_common(1)[0][1]
    score -= 2.0 * (most > 1 and most >= len(present) / 2)
    return score, i if len(rows) > 3 or len(row) == 2 else -i


def _side_facts(side_fields: list[list[str]], layout: TextLayout) -> list[Fact]:
    return [
        Fact(key=fields[0].rstrip(": "), values=tuple(field for field in fields[1:] if field), line=layout.first + i)
        for i, fields in enumerate(side_fields)
        if fields and fields[0] and any(fields[1:])
    ]
