"""Evaluation of a public set: what could be averaged, indicators by label, and answers of diagnoses."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import mannwhitneyu

from sigdb.core import ANSWERS, InputError, OnStep, __version__, ignore, plain
from sigdb.database import Database
from sigdb.diagnosis import diagnose
from sigdb.ingest import RecordingFacts
from sigdb.public_sets.public_set import Expected, PublicSet
from sigdb.public_sets.set_folder import FolderCheck
from sigdb.signature import INDICATORS

_DAMAGE = frozenset(kind for kind, form in ANSWERS.items() if form.exit_code == 1)
_ABSTAINED = "cannot be judged"


@dataclass(frozen=True, kw_only=True)
class DiagnosedFile:
    """The answer to a recording of a set.

    Attributes
    ----------
    file, channel, state
        The recording, its channel, and the word for its state.
    expected
        Right answer: ``damage``, ``none``, or ``unknown``.
    answer, sentence
        Kind of the answer, and the sentence.
    verdict
        ``right``, ``wrong``, ``abstained``, or ``not known``.
    """

    file: str
    channel: str
    state: str
    expected: Expected
    answer: str
    sentence: str
    verdict: str


@dataclass(frozen=True, kw_only=True)
class SetResults:
    """Results of a public set, from which a page can be made.

    Attributes
    ----------
    name, described
        Name of the set, and its description with all sources.
    versions
        Version of sigdb.
    folder
        Numbers of recordings, of others and of unknown files, and what is missing or changed.
    rows
        Number of rows by state and status code.
    indicators
        For each sensor and indicator: numbers of recordings, and the area under the ROC of damaged against healthy
        recordings, each counted once by its median.
    answers
        Answers of diagnoses.
    """

    name: str
    described: dict[str, Any]
    versions: dict[str, str]
    folder: dict[str, Any]
    rows: list[dict[str, Any]]
    indicators: list[dict[str, Any]]
    answers: tuple[DiagnosedFile, ...]

    @property
    def verdicts(self) -> dict[str, int]:
        """Number of answers by verdict."""
        return dict(Counter(answer.verdict for answer in self.answers))

    def as_json(self) -> dict[str, Any]:
        """Return all as JSON can hold it."""
        return {name: plain(value) for name, value in asdict(self).items()} | {"verdicts": self.verdicts}


def evaluate_set(
    described: PublicSet,
    check: FolderCheck,
    database: str | PathLike[str],
    *,
    diagnoses: int = 4,
    on_step: OnStep = ignore,
    settings: dict[str, Any] | None = None,
) -> SetResults:
    """Evaluate an ingested public set.

    Indicators of damaged and of healthy recordings are compared by the labels of the set, whatever these are worth.
    Some recordings are diagnosed, spread over the states, each channel against the healthy recordings of the nearest
    loads. The answers are compared with the right one. For a set without gear damage each that names damage is wrong.

    Parameters
    ----------
    described : PublicSet
        The set.
    check : FolderCheck
        Content of its folder.
    database : str or path-like
        The database that :func:`ingest_set` made.
    diagnoses : int
        Greatest number of recordings to diagnose.
    on_step : callable
        Called with the name of each recording before it is diagnosed.
    settings : dict, optional
        As in :func:`ingest_set`.

    Returns
    -------
    SetResults
        The results.
    """
    with Database(database) as opened:
        rows = opened.cases()
    return SetResults(
        name=check.name,
        described=described.model_dump(exclude_none=True),
        versions={"sigdb": __version__},
        folder={
            "recordings": len(check.recordings),
            "others": len(check.others),
            "unknown": len(check.unknown),
            "missing": list(check.missing),
            "changed": list(check.changed),
        },
        rows=_row_counts(rows),
        indicators=list(_separation(rows)),
        answers=tuple(_answers(described, check, rows, diagnoses, settings or {}, on_step)),
    )


def _row_counts(rows: pd.DataFrame) -> list[dict[str, Any]]:
    counts = rows.groupby(["state", "health", "status_code"], dropna=False)
    table = counts.agg(rows=("id", "size"), recordings=("recording", "nunique"), example=("status", "min"))
    return [{str(name): value for name, value in row.items()} for row in table.reset_index().to_dict("records")]


def _separation(rows: pd.DataFrame) -> "list[dict[str, Any]]":
    """Return the area under the ROC of each indicator by sensor; nan-free recordings only."""
    results: list[dict[str, Any]] = []
    ok = rows[(rows["status"] == "ok") & rows["health"].isin(["healthy", "damaged"])]
    for sensor, some in ok.groupby("sensor"):
        by_recording = some.groupby(["recording", "health"])[list(INDICATORS)].median().reset_index()
        for name in INDICATORS:
            values = by_recording[["health", name]].dropna()
            healthy, damaged = (values.loc[values["health"] == each, name] for each in ("healthy", "damaged"))
            if len(healthy) and len(damaged):
                area = mannwhitneyu(damaged, healthy).statistic / (len(damaged) * len(healthy))
                results.append(
                    {
                        "sensor": sensor,
                        "indicator": name,
                        "healthy": len(healthy),
                        "damaged": len(damaged),
                        "area": float(area),
                    }
                )
    return results


def _answers(
    described: PublicSet,
    check: FolderCheck,
    rows: pd.DataFrame,
    most: int,
    settings: dict[str, Any],
    on_step: OnStep,
) -> "list[DiagnosedFile]":
    """Return the answers to some recordings, each compared with healthy ones of the set by each channel."""
    files = {facts.file: facts for facts in check.recordings}
    healthy = [facts for facts in check.recordings if described.reference and fnmatch(facts.file, described.reference)]
    if not healthy or not most:
        return []
    stated = described.ingest_settings(settings)
    options = stated.reading.model_dump(exclude_unset=True, exclude_none=True)
    options |= stated.averaging.model_dump(exclude_unset=True, exclude_none=True)
    channels = [*stated.channels] or sorted(rows.loc[rows["channel"] != "", "channel"].unique())
    results = []
    for file in _spread(list(files), check.states, most):
        references = _references(files[file], healthy)
        if not references:
            continue
        loads = [files[file].load, *(each.load for each in references)]
        at: dict[str, Any] = {"load": loads[0], "healthy_load": loads[1:]} if None not in loads else {}
        for channel in channels:
            on_step(f"{file}, {channel}")
            state = check.states.get(file, "")
            expected = described.expected_of(state or None)
            try:
                done = diagnose(
                    check.folder / file,
                    rig=stated.rig,
                    teeth=stated.teeth,
                    healthy=[check.folder / each.file for each in references],
                    channel=channel,
                    **at,
                    **options,
                )
                kind, sentence = str(done.kind), done.answer
            except InputError as error:
                kind, sentence = _ABSTAINED, str(error)
            results.append(
                DiagnosedFile(
                    file=file,
                    channel=channel,
                    state=state,
                    expected=expected,
                    answer=kind,
                    sentence=sentence,
                    verdict=_verdict(kind, expected),
                )
            )
    return results


_REFERENCES = 3
"""Healthy recordings that one is compared with."""


def _references(recording: RecordingFacts, healthy: Sequence[RecordingFacts]) -> list[RecordingFacts]:
    """Return the other healthy recordings of the nearest loads."""
    others = [each for each in healthy if each.file != recording.file]
    return sorted(others, key=lambda each: abs((each.load or 0.0) - (recording.load or 0.0)))[:_REFERENCES]


def _verdict(kind: str, expected: Expected) -> str:
    if expected == "unknown":
        return "not known"
    if kind == _ABSTAINED:
        return "abstained"
    return "right" if (kind in _DAMAGE) == (expected == "damage") else "wrong"


def _spread(files: Sequence[str], states: dict[str, str], most: int) -> list[str]:
    """Return some files, of each state about as many, evenly spread among those of the state."""
    by_state: dict[str, list[str]] = {}
    for file in files:
        by_state.setdefault(states.get(file, ""), []).append(file)
    each = max(1, most // max(1, len(by_state)))
    chosen = [
        some[at]
        for some in by_state.values()
        for at in np.unique(np.linspace(0, len(some) - 1, min(each, len(some))).round().astype(int))
    ]
    return chosen[:most]
