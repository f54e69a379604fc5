"""Facts about the arrays of a file that short entries around them state: rates, starts, units and a speed."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import Note
from sigdb.recording.files.formats.stated_rates import SPEED_TO_CONFIRM, is_of, speed_of, start_of, stated_rate
from sigdb.recording.files.time_names import seconds_of, time_name

SAME = 1e-3
"""Relative difference below which two stated rates are equal: intervals are often rounded."""

UNITS = {"unit", "units", "unitstr", "yunit", "yunits", "unitstring", "einheit", "engunit"}
"""Names of entries with the unit of an array."""

ABSCISSA_UNITS = {"xunit", "xunits", "xlabel", "xquantity"}
"""Names of entries with the unit of the abscissa."""


@dataclass(frozen=True, kw_only=True)
class ArrayFacts:
    """Facts that a file states about one of its arrays.

    Attributes
    ----------
    unit
        Unit of its numbers; empty if none is stated.
    sampling_rate
        Sampling rate, Hz; None if none is stated.
    rate_from
        Name of the entry that states that rate.
    start
        Time of its first sample in s, on a time axis that all arrays of the file share; None if it is not stated.
    abscissa
        Quantity along its numbers; "time" if no other is stated.
    """

    unit: str = ""
    sampling_rate: float | None = None
    rate_from: str = "the file"
    start: float | None = None
    abscissa: str = "time"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A fact that an entry states about the arrays in its structure or group, or about the array ``owner``."""

    name: str
    scope: str
    value: float
    owner: str = ""


@dataclass(kw_only=True)
class StatedFacts:
    """Facts that entries state, the entries that state them, and notes.

    Attributes
    ----------
    rates, starts
        Entries with a sampling rate in Hz, and with the time of the first sample in s.
    units, abscissas
        Unit of the arrays in a structure or group, and the quantity along them where it is not the time, by its name.
    speed_rpm
        Speed in rev/min, to be confirmed; None if none is stated.
    used
        Names of the entries that state a rate, a start or a speed.
    notes
        Notes on entries that contradict each other, and on the speed.
    """

    rates: list[Entry] = field(default_factory=list)
    starts: list[Entry] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    abscissas: dict[str, str] = field(default_factory=dict)
    speed_rpm: float | None = None
    used: set[str] = field(default_factory=set)
    notes: list[Note] = field(default_factory=list)

    def of_array(self, name: str) -> ArrayFacts:
        """Return the facts about an array: those of the innermost structure or group that states any."""
        facts = ArrayFacts(unit=self._unit(name), abscissa=_nearest(self.abscissas, name) or "time")
        rate = self._rate(name)
        if rate is not None:
            facts = replace(facts, sampling_rate=rate.value, rate_from=rate.name)
        starts = _innermost(self.starts, name)
        return replace(facts, start=starts[0].value) if len({start.value for start in starts}) == 1 else facts

    def _rate(self, name: str) -> Entry | None:
        rates = _innermost(self.rates, name)
        if not rates:
            return self._other_rate(name)
        values = [rate.value for rate in rates]
        if max(values) - min(values) > SAME * max(values):
            text = f"{', '.join(rate.name for rate in rates[:8])} state different sampling rates, so none was taken"
            self.notes += [Note(code="different-rates", text=text)] if all(text != n.text for n in self.notes) else []
            return None
        return rates[0]

    def _other_rate(self, name: str) -> Entry | None:
        """Return the rate of other arrays for an array without one, if the file states a single rate."""
        values = [rate.value for rate in self.rates]
        if not values or max(values) - min(values) > SAME * max(values):
            return None
        text = f"{name} states no sampling rate; that of {self.rates[0].name} was taken"
        self.notes.append(Note(code="rate-of-another-array", text=text, values={"name": name}))
        return self.rates[0]

    def _unit(self, name: str) -> str:
        return "" if time_name(name).kind in ("time", "short", "count") else _nearest(self.units, name)


def stated_facts(entries: Mapping[str, ArrayLike], arrays: Sequence[str]) -> StatedFacts:
    """Return the facts that short entries state about arrays.

    An entry holds for the arrays in its structure or group, and in those within; one below an array's abscissa, such as
    ``ch1.x_values.increment``, for the arrays of ``ch1``. A name such as ``fs_vib`` holds for the array ``vib``.
    """
    facts = StatedFacts()
    speeds: dict[str, float] = {}
    scopes = {scope for name in arrays for scope in _scopes(name)}
    for name, value in entries.items():
        scope = next((scope for scope in _scopes(name) if scope in scopes), "")
        if (rate := stated_rate(name, value)) is not None:
            owner = next(
                (array for array in arrays if rate[1] and _parent(array) == scope and is_of(array, rate[1])), ""
            )
            facts.rates.append(Entry(name=name, scope=scope, value=rate[0], owner=owner))
        elif (start := start_of(name, value)) is not None:
            facts.starts.append(Entry(name=name, scope=scope, value=start))
        elif (speed := speed_of(name, value)) is not None:
            speeds[name] = speed
        elif isinstance(value, str):
            _note_unit(facts, name, scope, value)
            continue
        else:
            continue
        facts.used.add(name)
    _note_speed(facts, speeds)
    return facts


def _note_unit(facts: StatedFacts, name: str, scope: str, text: str) -> None:
    parts = [re.sub(r"[^a-z]", "", part.lower()) for part in re.split(r"[./]", name)]
    below_x = any(part in ("xvalues", "xaxis") for part in parts[:-1])
    if parts[-1] in ABSCISSA_UNITS or (below_x and parts[-1] in {*UNITS, "label"}):
        if seconds_of(text) is None and time_name(text).kind not in ("time", "short"):
            facts.abscissas[scope] = f"an abscissa in {text}"
    elif parts[-1] in UNITS or (parts[-1] == "label" and "yvalues" in parts):
        facts.units[scope] = text.strip()


def _note_speed(facts: StatedFacts, speeds: Mapping[str, float]) -> None:
    if not speeds:
        return
    name, speed = next(iter(speeds.items()))
    if np.ptp(list(speeds.values())) > SAME * speed:
        text = f"{', '.join(list(speeds)[:8])} state different speeds, so none was taken"
        facts.notes.append(Note(code="different-speeds", text=text))
        return
    facts.speed_rpm = speed
    text = f"{name} states {speed:.6g} rpm, a speed to be confirmed; give speed_rpm"
    facts.notes.append(Note(code=SPEED_TO_CONFIRM, text=text, values={"name": name, "speed_rpm": speed}))


def _innermost(entries: Sequence[Entry], array: str) -> list[Entry]:
    """Return the entries of the innermost scope that hold for an array; those that name it come before the others."""
    for scope in _scopes(array):
        here = [entry for entry in entries if entry.scope == scope and entry.owner in ("", array)]
        if here:
            return [entry for entry in here if entry.owner] or here
    return []


def _nearest(by_scope: Mapping[str, str], array: str) -> str:
    return next((by_scope[scope] for scope in _scopes(array) if by_scope.get(scope)), "")


def _scopes(name: str) -> list[str]:
    """Return the structures or groups around a part of a file, the innermost first, and the file itself."""
    scopes = []
    while name:
        name = _parent(name)
        scopes.append(name)
    return scopes or [""]


def _parent(name: str) -> str:
    at = max(name.rfind("."), name.rfind("/"))
    return name[:at] if at > 0 else ""
