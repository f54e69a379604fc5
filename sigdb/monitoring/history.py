"""History of a gear by one sensor: its indicators over time, the answer at the newest look, and what has changed."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import Answer, FloatArray, InputError, Note, plain
from sigdb.diagnosis import LevelChange, Power, cause_text, level_change, power_sentence
from sigdb.monitoring.alarms import (
    LEAST_HEALTHY,
    ChangePoint,
    LevelReference,
    Trend,
    alarm_limit,
    change_point,
    growth_limit,
    trend,
)
from sigdb.monitoring.kept_results import KeptResults
from sigdb.monitoring.look_results import LookResults, Reference
from sigdb.monitoring.look_table import UNSTATED, look_table
from sigdb.monitoring.looks import Look
from sigdb.monitoring.settings import MonitorSettings
from sigdb.monitoring.tooth_growth import ToothGrowth, tooth_growth
from sigdb.transmission import small_matrices

_FIRST = 10
"""Healthy looks where none is labelled."""

_ALL_TEETH = 0.1
"""Energy of the rest of the turn, relative to the greatest of a tooth, that all teeth have together; assumed."""

_POWER_STEP = 0.1
"""Step of the limit, in healthy deviations, to which it is rounded up for the power: it changes with each look."""

_LEAST_LOOKS, _DAILY = 2, 365.0
"""Least dated looks from which their rate is taken, and the rate without."""

_WITHIN = 2
"""Teeth on each side of the place of a pulse that the damaged tooth may be."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GearHistory:
    """History of a gear by one sensor.

    Attributes
    ----------
    place
        ``machine``, ``gear``, ``teeth``, ``sensor`` and ``channel``.
    answer
        Answer at the newest look.
    looks
        A row for each look: ``recording``, ``day``, ``healthy``, ``health_indicator``, ``tooth_indicator``,
        ``rest_indicator`` (of the turn without the strongest pulse) and ``level`` in healthy deviations, ``tooth``,
        ``level_db``, ``likeness``, ``na4_star``, ``nb4_star``, ``rms``, ``record_rms``, ``zone``, ``doubt``,
        ``growth_statistic`` and ``alarm``. A look is no alarm where its ``doubt`` names what may explain the
        difference: ``speed`` or ``load`` outside those of the healthy looks, or ``load or sensor`` where the load is
        not stated. Then it is an alarm only where it differs from the first ten looks after the change of level.
    tooth_map
        (L, Z) energy of the difference from the reference in each tooth pass, relative to that of noise.
    limit
        Limit of the indicators in healthy deviations.
    false_alarms_a_year, looks_a_year, healthy_looks
        Rate of false alarms and the numbers that the limit counts.
    change
        The instant of a change; None without one.
    trend
        Straight line through the indicator since that change, or since the healthy looks; None for fewer than three.
    level
        Change of the newest look that is the same for all teeth; None where nothing was compared.
    power
        Pulse that would have been seen in a healthy look; None where nothing was compared.
    growth, growth_limit
        Growth of a tooth's difference, and the limit of its statistic; None where nothing was compared.
    since
        Comparison with the first looks after a change of level that nobody states; None without one.
    notes
        Notes.
    """

    place: dict[str, str]
    answer: Answer
    looks: pd.DataFrame
    tooth_map: FloatArray
    limit: float
    false_alarms_a_year: float
    looks_a_year: float
    healthy_looks: int
    change: ChangePoint | None = None
    trend: Trend | None = None
    level: LevelChange | None = None
    power: Power | None = None
    growth: ToothGrowth | None = None
    growth_limit: float = np.nan
    since: LevelReference | None = None
    notes: tuple[Note, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the history as plain values for JSON."""
        power = None
        if self.power is not None:
            tables = {name: getattr(self.power, name).to_dict("records") for name in ("exceptions", "table")}
            power = vars(self.power) | tables
        facts = {
            **self.place,
            "kind": self.answer.kind,
            "answer": self.answer.sentence,
            "exit_code": self.answer.exit_code,
            "limit": self.limit,
            "false_alarms_a_year": self.false_alarms_a_year,
            "looks_a_year": self.looks_a_year,
            "healthy_looks": self.healthy_looks,
            "change": self.change,
            "trend": self.trend,
            "level": None if self.level is None else vars(self.level),
            "power": power,
            "growth": self.growth,
            "growth_limit": self.growth_limit,
            "since": self.since,
            "looks": self.looks.to_dict("records"),
            "tooth_map": self.tooth_map,
            "notes": self.notes,
        }
        return {name: plain(value) for name, value in facts.items()}


@small_matrices
def gear_history(
    looks: Sequence[Look],
    settings: MonitorSettings | None = None,
    *,
    place: Mapping[str, str] | None = None,
    kept: KeptResults | None = None,
) -> GearHistory:
    """Return the history of a gear from its looks.

    Parameters
    ----------
    looks : sequence of Look
        Looks at one gear by one sensor, the oldest first.
    settings : MonitorSettings, optional
        Rate of false alarms, healthy looks and zones; the defaults if left out.
    place : mapping, optional
        Names of the machine, the gear and the sensor.
    kept : KeptResults, optional
        Results of earlier looks against the same healthy ones; those of new looks are added.

    Returns
    -------
    GearHistory
        It cannot be judged where fewer than five looks are healthy.
    """
    settings = settings or MonitorSettings()
    kept = KeptResults() if kept is None else kept
    place = dict(place or {})
    healthy, notes = healthy_looks(looks, settings)
    rate, rate_notes = _looks_a_year(looks, settings)
    notes += rate_notes
    reference = Reference.of([look for look, good in zip(looks, healthy, strict=True) if good])
    allowed = settings.false_alarms_a_year
    enough = healthy.sum() >= LEAST_HEALTHY
    used, results, errors = kept.of(looks if enough else [], reference.result)
    for number, error in errors.items():
        name = looks[number].name
        notes.append(Note(code="look-left-out", text=f"{name} was left out: {error}", values={"look": name}))
    some, good = [looks[number] for number in used], healthy[used]
    count = int(good.sum()) if errors else int(healthy.sum())
    if not enough or results is None or count < LEAST_HEALTHY:
        return GearHistory(
            place=place,
            answer=Answer.of("cannot be judged", reason=_few_healthy(count, errors)),
            looks=pd.DataFrame(),
            tooth_map=np.zeros((0, 0)),
            limit=np.nan,
            false_alarms_a_year=allowed,
            looks_a_year=rate,
            healthy_looks=count,
            notes=tuple(notes),
        )
    limit = alarm_limit(false_alarms_a_year=allowed, looks_a_year=rate, healthy=count)
    table = look_table(some, results, good, limit, reference=reference, settings=settings)
    days = None if any(look.day is None for look in some) else np.array([look.day for look in some], float)
    doubted = table["doubt"].to_numpy() != ""
    most = growth_limit(false_alarms_a_year=allowed, looks_a_year=rate)
    from_what = [look.key for look in some], good.tolist(), doubted.tolist(), None if days is None else days.tolist()
    of = hashlib.sha256(json.dumps([*from_what, most, settings.severity_limit_db]).encode()).hexdigest()
    growth = kept.once(
        "growth",
        of,
        lambda: tooth_growth(
            results.tooth_map, good, days, doubted=doubted, alarm=most, limit_db=settings.severity_limit_db
        ),
    )
    table["growth_statistic"] = growth.statistic
    table["alarm"] |= (growth.statistic > most) & ~doubted & ~good
    signal = table["tooth_indicator"] if table["tooth_indicator"].iloc[-1] > limit else table["health_indicator"]
    step = change_point(signal.to_numpy())
    begin = int(good.nonzero()[0][-1]) if step is None else step.look
    seen = _power(reference, results, good, limit, kept)
    level = kept.once("level", some[-1].key, lambda: _level(reference, some[-1]))
    absolute = kept.once("absolute", "", lambda: reference.healthy.absolute)
    grown = growth.tooth if growth.stands_out else None
    answer, more = _answer(table, results.take([-1]), limit, level, seen, grown=grown, absolute=absolute)
    since = None
    if later := _after_level_change(some, table["doubt"] == UNSTATED):
        stated = settings.model_copy(update={"baseline": _FIRST, "looks_a_year": rate})
        after = gear_history(later, stated, place=place, kept=kept.against(later[:_FIRST]))
        since = LevelReference(look=len(some) - len(later), looks=_FIRST, limit=after.limit, answer=after.answer)
        names = set(after.looks["recording"][after.looks["alarm"]]) if len(after.looks) else set()
        table["alarm"] |= table["recording"].isin(names)
        answer = after.answer if after.answer.exit_code == 1 else answer
        more += [_level_note(later, after.answer)]
    return GearHistory(
        place=place,
        answer=answer,
        looks=table,
        tooth_map=results.tooth_map,
        limit=limit,
        false_alarms_a_year=allowed,
        looks_a_year=rate,
        healthy_looks=count,
        change=step,
        trend=trend(None if days is None else days[begin:], signal.to_numpy()[begin:]),
        level=level,
        power=seen,
        growth=growth,
        growth_limit=most,
        since=since,
        notes=(*notes, *more, *growth.notes),
    )


def _after_level_change(looks: Sequence[Look], doubted: pd.Series) -> list[Look]:
    """Return the looks since a change of level that lasts; none where they are too few, or labelled as damaged."""
    sure = np.flatnonzero(~doubted)
    later = list(looks[int(sure[-1]) + 1 if sure.size else 0 :])
    return later if len(later) > _FIRST and all(look.health != "damaged" for look in later[:_FIRST]) else []


def _level_note(later: Sequence[Look], answer: Answer) -> Note:
    text = (
        f"The level has changed at {later[0].name}, and no load is stated. The looks since then are also compared with "
        f"the first {_FIRST} of them: {answer.sentence} Damage that these {_FIRST} have is not seen by that."
    )
    return Note(code="level-reference", text=text, values={"look": later[0].name, "kind": answer.kind})


def _few_healthy(count: int, errors: Mapping[int, InputError]) -> str:
    """Return why a history with so few healthy looks that can be compared has no answer."""
    left = f" that can be compared, {len(errors)} are left out" if errors else ""
    looks = "1 look is" if count == 1 else f"{count} looks are"
    return (
        f"{looks} healthy{left}, fewer than {LEAST_HEALTHY}; record more of the undamaged gear, or label them healthy"
    )


def healthy_looks(looks: Sequence[Look], settings: MonitorSettings) -> tuple[np.ndarray, list[Note]]:
    """Return whether each look is taken as healthy (L,), and a note where that is assumed."""
    labelled = np.array([look.health == "healthy" for look in looks])
    if settings.baseline is not None:
        return np.arange(len(looks)) < settings.baseline, []
    if labelled.sum() >= LEAST_HEALTHY:
        return labelled, []
    first = (np.arange(len(looks)) < _FIRST) & np.array([look.health != "damaged" for look in looks])
    if not first.any():
        return first, []
    which = f"{int(first.sum())} of the first {min(len(looks), _FIRST)} recordings"
    text = f"Fewer than five recordings are labelled healthy: {which} were taken to be."
    return first, [Note(code="healthy-assumed", text=text, values={"looks": int(first.sum())})]


def _looks_a_year(looks: Sequence[Look], settings: MonitorSettings) -> tuple[float, list[Note]]:
    if settings.looks_a_year is not None:
        return settings.looks_a_year, []
    days = [look.day for look in looks if look.day is not None]
    if len(days) == len(looks) >= _LEAST_LOOKS and days[-1] > days[0]:
        return 365.25 * (len(looks) - 1) / (days[-1] - days[0]), []
    undated = [look.name for look in looks if look.day is None]
    why = (
        f"{len(undated)} of {len(looks)} recordings have no date, the first is {undated[0]}: their order is that of "
        "their ingest and of their names, and one look a day was assumed"
        if undated
        else "All recordings have one date: one look a day was assumed"
    )
    text = f"{why}; state looks_a_year."
    return _DAILY, [Note(code="looks-assumed", text=text)]


def _power(reference: Reference, results: LookResults, healthy: np.ndarray, limit: float, kept: KeptResults) -> Power:
    """Return the pulse that would have been seen in a healthy look, at the limit rounded up."""
    steps = np.ceil(limit / _POWER_STEP)
    pulses = results.pulse[healthy]
    least = float(pulses.mean() + steps * _POWER_STEP * max(pulses.std(ddof=1), 0.05))
    return kept.once("power", f"{steps:.0f}", lambda: reference.power(least))


def _level(reference: Reference, look: Look) -> LevelChange:
    """Return what of a look has changed for all teeth alike, and the likelier cause."""
    signature = look.read()
    change, run, mean = reference.change(look, signature)
    speeds = [each.speed_rpm for each in reference.signatures]
    load, loads = reference.load_of(look), [each for each in reference.torques if each is not None]
    return level_change(
        run,
        mean.turned(change.turn),
        reference.healthy,
        speeds_rpm=(signature.speed_rpm, float(np.clip(signature.speed_rpm, min(speeds), max(speeds)))),
        torques=(load, float(np.clip(load, min(loads), max(loads))) if load is not None and loads else None),
    )


def _answer(
    table: pd.DataFrame,
    result: LookResults,
    limit: float,
    level: LevelChange,
    seen: Power,
    *,
    grown: int | None,
    absolute: bool,
) -> tuple[Answer, list[Note]]:
    """Return the answer at the newest look, and notes on it."""
    newest = table.iloc[-1]
    notes: list[Note] = []
    exceeds = max(newest["health_indicator"], newest["tooth_indicator"]) > limit or grown is not None
    if exceeds and newest["doubt"] == UNSTATED:
        reason = (
            f"load or sensor may have changed: all mesh harmonics have by {abs(result.common_db[0]):.1f} dB or more, "
            "which may explain the difference; state the loads, or label recordings since then as healthy"
        )
        return Answer.of("cannot be judged", reason=reason), notes
    if exceeds and newest["doubt"]:
        reason = (
            f"the {newest['doubt']} lies outside that of the healthy looks, which may explain the difference; label "
            f"recordings at this {newest['doubt']} as healthy"
        )
        return Answer.of("cannot be judged", reason=reason), notes
    share = float(np.exp(result.rest[0]) / result.tooth_map.max())
    if newest["rest_indicator"] > limit and share > _ALL_TEETH:
        text = (
            f"The errors of the teeth have a correlation of {newest['likeness']:.2f} with those of the healthy looks, "
            f"which have {table.loc[table['healthy'], 'likeness'].median():.2f} among themselves."
        )
        notes.append(Note(code="teeth-unlike", text=text, values={"likeness": float(newest["likeness"])}))
        return Answer.of("gear changed", reason="the difference is large over the whole turn"), notes
    if newest["tooth_indicator"] > limit or (grown is not None and newest["health_indicator"] <= limit):
        teeth = f"{newest['tooth'] if newest['tooth_indicator'] > limit else grown} ± {_WITHIN}"
        where = "" if absolute else ", counted from where the first healthy average begins"
        return Answer.of("one tooth", teeth=teeth, counted=where), notes
    if newest["health_indicator"] > limit:
        reason = f"the health indicator is {newest['health_indicator']:.3g} healthy deviations, the limit {limit:.3g}"
        return Answer.of("gear changed", reason=reason), notes
    power = power_sentence(seen)
    if seen.smallest is None:
        return Answer.of("cannot be judged", reason=power), notes
    if abs(newest["level"]) > limit or level.cause == "polarity":
        cause = cause_text(level.cause if level.changed else "load or mounting")
        return Answer.of("level changed", cause=cause, power=power), notes
    return Answer.of("no change", power=power), notes
