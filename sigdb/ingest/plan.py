"""The plan of an ingest: the recordings with their facts, and the parts that they are made in."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, Self

from sigdb.core import DatabaseError, validated
from sigdb.database import FORMAT, MANIFEST_FILE, PlanRecord, Store, sealed_json, unsealed
from sigdb.ingest.facts.recording_facts import RecordingFacts
from sigdb.ingest.settings import IngestSettings
from sigdb.transmission import Transmission

PART_ROWS = 65536
"""Ids of a part: part k holds ids from ``PART_ROWS k`` on, as many as its recordings give."""

MOVES_FILE = "recordings/moves.json"
"""File of a database with the paths of recordings that have moved, by those of their ingest."""

_MOST_RECORDINGS, _PARTS_WANTED = 64, 64

Source = Literal["measured", "simulated elsewhere"]
"""Origin of rows: recordings, or averages that another program has simulated."""


@dataclass(frozen=True, kw_only=True)
class PlannedRecording:
    """A file of an ingest.

    Attributes
    ----------
    path
        Its full path.
    name
        Its path below the folder of the recordings.
    bytes
        Its size.
    stated
        Its facts as JSON holds them: one entry, or several of different gears or channels.
    specimens
        Number of the specimen of each entry; None where it is unknown.
    """

    path: str
    name: str
    bytes: int
    stated: tuple[dict[str, Any], ...]
    specimens: tuple[int | None, ...]

    @cached_property
    def facts(self) -> tuple[RecordingFacts, ...]:
        """Its facts; they are checked here, since a database may have thousands of recordings that nothing reads."""
        return tuple(validated(RecordingFacts, {"file": self.name, **each}, owner=self.name) for each in self.stated)

    def as_json(self) -> dict[str, Any]:
        """Return the recording as a list of recordings holds it."""
        place = {"path": self.path, "name": self.name, "bytes": self.bytes}
        return place | {"facts": list(self.stated), "specimens": list(self.specimens)}

    def at(self, moves: Mapping[str, str]) -> "PlannedRecording":
        """Return the recording at its new path, where it has moved."""
        return self if self.path not in moves else replace(self, path=moves[self.path])

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Self:
        """Return the recording that :meth:`as_json` wrote."""
        place = {name: content[name] for name in ("path", "name", "bytes")}
        return cls(**place, stated=tuple(content["facts"]), specimens=tuple(content["specimens"]))


@dataclass(frozen=True, kw_only=True)
class IngestPlan:
    """Recordings that are ingested together.

    Attributes
    ----------
    settings
        Settings of averages and of reading.
    rigs
        The rigs that settings and facts name.
    recordings
        The files, in order.
    first_part
        Number of the first part.
    stored_list
        Content of the file with the list of its recordings, where it exists.
    grows
        Hash of the earlier plan, of the same settings, that grows by the recordings; None where there is none.
    """

    settings: IngestSettings
    rigs: dict[str, Transmission]
    recordings: tuple[PlannedRecording, ...]
    first_part: int = 0
    stored_list: bytes | None = None
    grows: str | None = None

    @property
    def source(self) -> Source:
        """Origin of the rows."""
        return "measured" if self.settings.averages_of is None else "simulated elsewhere"

    @property
    def recordings_of_a_part(self) -> int:
        """Number of recordings in a part, fixed by the number of all of them."""
        return min(max(1, -(-len(self.recordings) // _PARTS_WANTED)), _MOST_RECORDINGS)

    @property
    def most_rows(self) -> int:
        """Greatest number of rows that a recording may give."""
        return PART_ROWS // self.recordings_of_a_part

    @property
    def row_part_numbers(self) -> range:
        """Numbers of its parts."""
        return range(self.first_part, self.first_part + -(-len(self.recordings) // self.recordings_of_a_part))

    def recordings_of(self, part: int) -> tuple[PlannedRecording, ...]:
        """Return the recordings of a part."""
        size = self.recordings_of_a_part
        start = (part - self.first_part) * size
        return self.recordings[start : start + size]

    @property
    def list_name(self) -> str:
        """Name of the file with the list of its recordings."""
        return list_name(self.first_part)

    @cached_property
    def list_content(self) -> bytes:
        """Content of that file."""
        if self.stored_list is not None:
            return self.stored_list
        return sealed_json({"recordings": [recording.as_json() for recording in self.recordings]})

    @cached_property
    def resolved(self) -> dict[str, Any]:
        """Everything that determines the rows; the list of recordings by its SHA-256."""
        return {
            "format": FORMAT,
            "ingest": self.settings.resolved(),
            "signature": {"samples_per_tooth": self.settings.samples_per_tooth},
            "rigs": {name: rig.model_dump(mode="json", exclude_none=True) for name, rig in self.rigs.items()},
            "recordings": hashlib.sha256(self.list_content).hexdigest(),
        }

    @cached_property
    def hash(self) -> str:
        """SHA-256 of :attr:`resolved`; that of the plan that grows by its recordings, if there is one."""
        return self.grows or hashlib.sha256(json.dumps(self.resolved, sort_keys=True).encode()).hexdigest()

    def is_alike(self, other: "IngestPlan") -> bool:
        """Return whether another plan has the same settings and rigs."""
        mine, others = ({**plan.resolved, "recordings": ""} for plan in (self, other))
        return json.dumps(mine, sort_keys=True) == json.dumps(others, sort_keys=True)

    def grown(self, record: PlanRecord) -> PlanRecord:
        """Return the record of the plan that grows by its recordings."""
        parts = (record.parts or 0) + len(self.row_part_numbers)
        return replace(record, parts=parts, grown=_chained(record.grown, self.list_content))

    @property
    def record(self) -> PlanRecord:
        """The record of the plan that a database keeps."""
        return PlanRecord(
            hash=self.hash,
            seed=0,
            rows=0,
            templates=0,
            first_row_part=self.first_part,
            resolved=self.resolved,
            parts=len(self.row_part_numbers),
        )


def list_name(first_part: int) -> str:
    """Return the name of the file with the list of recordings of a plan."""
    return f"recordings/list-{first_part:05d}.json"


def _chained(digest: str | None, content: bytes) -> str:
    """Return the SHA-256 over lists of recordings, from that over all but the last."""
    return hashlib.sha256((digest or "").encode() + hashlib.sha256(content).digest()).hexdigest()


def plans_of(record: PlanRecord, store: Store) -> list[IngestPlan]:
    """Return the plan of a record with its list of recordings, and those by which it has grown.

    Raises
    ------
    DatabaseError
        If a list is missing or damaged, or is not that of the record.
    """
    settings = validated(IngestSettings, record.resolved["ingest"], owner=str(store))
    rigs = {key: validated(Transmission, rig, owner=str(store)) for key, rig in record.resolved["rigs"].items()}
    plans: list[IngestPlan] = []
    first, stop = record.first_row_part, record.first_row_part + (record.parts or 0)
    digest = None
    while not plans or first < stop:
        name = list_name(first)
        stored = store.get(name)
        content = unsealed(stored, name=store.name_of(name))
        plan = IngestPlan(
            settings=settings,
            rigs=rigs,
            recordings=tuple(map(PlannedRecording.from_json, content["recordings"])),
            first_part=first,
            stored_list=stored,
            grows=record.hash if plans else None,
        )
        if not plan.recordings or (not plans and plan.hash != record.hash):
            raise DatabaseError(f"{store.name_of(name)} is not the list of the recordings that {MANIFEST_FILE} names")
        if plans:
            digest = _chained(digest, stored)
        plans.append(plan)
        first = plan.row_part_numbers.stop
    if digest != record.grown:
        last = store.name_of(plans[-1].list_name)
        raise DatabaseError(f"{last}, or a list before it, is not that of the recordings that {MANIFEST_FILE} names")
    return plans


def stored_plans(records: Sequence[PlanRecord], store: Store) -> list[IngestPlan]:
    """Return the plans of a database, with the paths that its recordings have now."""
    plans, moves = [plan for record in records for plan in plans_of(record, store)], read_moves(store)
    if not moves:
        return plans
    return [replace(plan, recordings=tuple(each.at(moves) for each in plan.recordings)) for plan in plans]


def read_moves(store: Store) -> dict[str, str]:
    """Return the paths that recordings have now by those of their ingest; empty where none has moved.

    Raises
    ------
    DatabaseError
        If the file is damaged.
    """
    if store.size(MOVES_FILE) is None:
        return {}
    moves: dict[str, str] = unsealed(store.get(MOVES_FILE), name=store.name_of(MOVES_FILE))["moves"]
    return moves
