"""Recordings of a machine by one channel, with the healthy ones and the templates that they are compared with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import Self, TypedDict, Unpack, cast

from sigdb.core import InputError, Note, validated
from sigdb.database import is_database
from sigdb.diagnosis.diagnose_signature import absent_gears, diagnose_signature
from sigdb.diagnosis.diagnosis import Diagnosis, unjudged
from sigdb.diagnosis.healthy_rows import healthy_rows
from sigdb.diagnosis.joined_signature import Candidate, joined_candidate
from sigdb.diagnosis.mate import Mate, diagnosis_of_pair, mate_note
from sigdb.diagnosis.notes import reading_notes
from sigdb.diagnosis.rig_templates import Source, averaged_gear_of, stored_bank
from sigdb.diagnosis.stored_reference import SimulatedTemplates, StoredReference, is_reference
from sigdb.ingest import database_defaults
from sigdb.recording import (
    AngleOptions,
    AveragingSettings,
    FileOptions,
    NoMeshError,
    RecordedSignature,
    Recording,
    RecordingBlocks,
    RecordingSettings,
    read_of_any_size,
)
from sigdb.transmission import Transmission, load_transmission, new_rig

AnyRecording = Recording | RecordingBlocks | str | PathLike[str]
"""A recording, its blocks, or the path of a file."""

_SAMPLES_PER_TOOTH = 64
_READING = set(RecordingSettings.model_fields) - set(AveragingSettings.model_fields) - {"torque", "load"}
"""Options of reading a recording that are not options of its average too."""

_ASSUMED_TORQUE = 50.0
"""Torque, N m, for which a rig of tooth counts is sized where none is given; assumed."""

_ASSUMED_RPM = 1500.0
"""Speed, rpm, of a rig of tooth counts before the recording's speed is known."""


class _Stored(TypedDict):
    """Model or database whose templates are used, and the sensor."""

    model: str | PathLike[str] | None
    database: str | PathLike[str] | None
    sensor: str | None


class DiagnosisOptions(FileOptions, AngleOptions, total=False):
    """Options of reading and averaging a recording as keyword arguments of :func:`diagnose`."""

    samples_per_tooth: int


@dataclass(frozen=True, kw_only=True, eq=False)
class MachineRecordings:
    """Recordings of a machine by one channel, with the healthy ones that they are compared with.

    Attributes
    ----------
    source
        Source of templates.
    gear, teeth
        The averaged gear, None with a tooth count alone, and its tooth count.
    settings
        Settings of the averages.
    read
        The recordings, and the healthy recordings after them.
    count
        Number of the former.
    stored
        References of the machine.
    databases, where
        Databases of recordings whose healthy rows are compared too, and the condition of these.
    """

    source: Source
    gear: str | None
    teeth: int
    settings: AveragingSettings
    read: tuple[Recording | RecordingBlocks, ...]
    count: int
    stored: tuple[StoredReference, ...]
    databases: tuple[str, ...]
    where: str | None

    @classmethod
    def of(
        cls,
        recording: AnyRecording | Sequence[AnyRecording],
        rig: Transmission | str | PathLike[str] | None,
        *,
        healthy: AnyRecording | Sequence[AnyRecording],
        teeth: str | int | None,
        module: float | str | None,
        gear: str | None,
        torque: float | None,
        where: str | None,
        model: str | PathLike[str] | None,
        database: str | PathLike[str] | None,
        sensor: str | None,
        **options: Unpack[DiagnosisOptions],
    ) -> Self:
        """Read recordings, as of :func:`diagnose`."""
        recordings, references = _listed(recording), _listed(healthy)
        if not recordings or (len(recordings) > 1 and not references):
            needed_by = (
                "several recordings are joined to be compared with" if recordings else "there is no recording for"
            )
            raise InputError(f"{needed_by} healthy recordings; give {'healthy' if recordings else 'one'}")
        databases = [cast(str, each) for each in references if is_database(each)]
        references = [each for each in references if not is_database(each)]
        if databases:
            defaults = database_defaults(databases[0])
            if rig is None and teeth is None:
                rig, teeth, gear = defaults.rig, defaults.teeth, gear or defaults.gear
            needed = {"samples_per_tooth": defaults.samples_per_tooth, **defaults.averaging}
            needed |= {} if isinstance(recordings[0], Recording | RecordingBlocks) else defaults.reading
            options = cast(DiagnosisOptions, needed | {name: each for name, each in options.items() if each})
        elif where is not None:
            raise InputError(f"where = {where!r} selects rows of a database, and healthy names none")
        source, gear, count = _source(
            rig, teeth, module, gear, model=model, database=database, sensor=sensor, torque=torque
        )
        for each in recordings:
            if _is_stored(each):
                raise InputError(f"{each} is the reference of a machine, not a recording; give it as healthy")
        raw = [each for each in references if not _is_stored(each)]
        reading, averaging = _split_options(options, [*recordings, *raw])
        return cls(
            source=source,
            gear=gear,
            teeth=count,
            settings=_averaging(averaging, source, gear, count),
            read=tuple(_read(each, reading) for each in (*recordings, *raw)),
            count=len(recordings),
            stored=tuple(StoredReference.load(cast(str, each)) for each in references if _is_stored(each)),
            databases=tuple(databases),
            where=where,
        )

    def by(self, channel: str) -> Self:
        """Return the same recordings by another channel."""
        return replace(self, settings=self.settings.model_copy(update={"channel": channel}))

    @cached_property
    def candidates(self) -> list[Candidate]:
        """The averages of all that was read."""
        return [Candidate.of(each, self.settings, self.source.rig) for each in self.read]

    def diagnosis(
        self,
        some: Sequence[int],
        *,
        sensor: str | None,
        torque: float | None,
        healthy_torque: Sequence[float],
        load: float | None,
        healthy_load: Sequence[float],
        save_reference: str | PathLike[str] | None = None,
    ) -> Diagnosis:
        """Diagnose some of the recordings, by their numbers, as of :func:`diagnose`."""
        source, gear = self.source, self.gear
        runs = [self.candidates[number] for number in some]
        others = self.candidates[self.count :]
        run = joined_candidate(runs, torque=torque, load=load)
        others += [
            Candidate(result=each.signature, torque=each.torque, load=each.load)
            for reference in self.stored
            for each in reference.healthy
        ]
        row_notes: tuple[Note, ...] = ()
        if self.databases and isinstance(run.result, RecordedSignature):
            for name in self.databases:
                facts = {"teeth": run.result.teeth, "samples": len(run.result.tsa)}
                rows, row_notes = healthy_rows(name, where=self.where, channel=run.result.channel, **facts)
                others += [Candidate(result=row.signature, torque=row.torque, load=row.load) for row in rows]
        results = {"recording": run.result} | {f"healthy {i + 1}": each.result for i, each in enumerate(others)}
        if reasons := absent_gears(results):
            return _without_gear(results, reasons, teeth=self.teeth)
        signature, *healthy = (result for result in results.values() if isinstance(result, RecordedSignature))
        loads, healthy_loads, notes = _loads(
            run, others, torque=torque, healthy_torque=healthy_torque, load=load, healthy_load=healthy_load
        )
        notes = (*row_notes, *notes)
        simulated: SimulatedTemplates | None = None
        if source.rig is not None and gear is not None and (healthy or save_reference is not None):
            at = next((value for value in (torque, run.torque) if value is not None), source.rig.operating.torque)
            speed_rpm = signature.speed_rpm / abs(source.rig.ratio(source.rig.gears[gear].shaft))
            notes = (*notes, *source.speed_notes(speed_rpm))
            simulated = source.templates(
                gear=gear,
                sensor=sensor,
                channel=signature.channel,
                speed_rpm=speed_rpm,
                torque=at,
                samples_per_tooth=self.settings.samples_per_tooth,
                stored=[each.simulated for each in self.stored if each.simulated is not None],
            )
        if save_reference is not None:
            kept = tuple(each.as_healthy() for each in others or [run])
            StoredReference(healthy=kept, simulated=None if source.bank else simulated).save(save_reference)
        diagnosis = diagnose_signature(
            signature,
            healthy,
            templates=simulated.templates if simulated is not None and healthy else None,
            torque=loads,
            healthy_torques=healthy_loads,
            assumed=simulated.assumed if simulated is not None and healthy else (),
        )
        if source.rig is not None and gear is not None and healthy:
            diagnosis = _with_mate(
                diagnosis,
                [*(self.read[number] for number in some), *self.read[self.count :]],
                [each.result for each in (*runs, *others) if isinstance(each.result, RecordedSignature)],
                source.rig,
                self.settings,
                runs=len(runs),
                torque=loads,
                healthy_torques=healthy_loads,
            )
        return replace(diagnosis, notes=(*source.notes, *notes, *diagnosis.notes))


def _with_mate(
    diagnosis: Diagnosis,
    recordings: Sequence[Recording | RecordingBlocks],
    signatures: Sequence[RecordedSignature],
    rig: Transmission,
    settings: AveragingSettings,
    *,
    runs: int,
    torque: float | None,
    healthy_torques: Sequence[float | None],
) -> Diagnosis:
    """Return the diagnosis of the gear of the pair that has changed; with a note where the mate cannot be compared."""
    try:
        if len(recordings) < len(signatures):
            raise InputError("averages of a reference or a database are those of one gear; give healthy recordings")
        mate = Mate.of(recordings, signatures, rig, settings, runs=runs, torque=torque, healthy_torques=healthy_torques)
    except InputError as error:
        return replace(diagnosis, notes=(*diagnosis.notes, mate_note(error)))
    return diagnosis_of_pair(diagnosis, mate)


_ANY_RPM = (300.0, 6000.0)
"""Range in which an unknown speed is searched, rev/min."""


def _listed(healthy: AnyRecording | Sequence[AnyRecording]) -> list[AnyRecording]:
    return [healthy] if isinstance(healthy, Recording | RecordingBlocks | str | PathLike) else list(healthy)


def _source(
    rig: Transmission | str | PathLike[str] | None,
    teeth: str | int | None,
    module: float | str | None,
    gear: str | None,
    *,
    torque: float | None,
    **stored: Unpack[_Stored],
) -> tuple[Source, str | None, int]:
    """Return the source of the templates, the averaged gear, and its tooth count."""
    if rig is not None and teeth is not None:
        raise InputError("rig and teeth are given together; the rig has the tooth counts")
    if rig is not None:
        machine = rig if isinstance(rig, Transmission) else load_transmission(str(rig))
        bank, notes = stored_bank(machine, **stored)
        named = averaged_gear_of(machine, gear)
        return Source(rig=machine, described=True, bank=bank, notes=notes), named, machine.gears[named].teeth
    if stored["model"] is not None or stored["database"] is not None:
        raise InputError("model or database is given without the rig of its templates; give the rig")
    if teeth is None:
        raise InputError("neither a rig nor tooth counts are given; give a rig, or teeth such as 32/80")
    text = str(teeth)
    if text.strip().isdigit():
        if gear is not None:
            raise InputError(f"gear = {gear!r} is given with one tooth count; give both counts, such as {text}/80")
        return Source(rig=None, described=False), None, int(text)
    pair = new_rig(
        teeth=text,
        speed=_ASSUMED_RPM,
        torque=_ASSUMED_TORQUE if torque is None else torque,
        module=module,
        name="assumed-rig",
    )
    named = averaged_gear_of(pair, gear)
    return Source(rig=pair, described=False), named, pair.gears[named].teeth


def _is_stored(recording: AnyRecording) -> bool:
    return not isinstance(recording, Recording | RecordingBlocks) and is_reference(recording)


def _averaging(options: Mapping[str, object], source: Source, gear: str | None, teeth: int) -> AveragingSettings:
    """Return the settings of the averages, of a gear of the rig or of a tooth count alone."""
    defaults: dict[str, object] = {"samples_per_tooth": source.samples_per_tooth or _SAMPLES_PER_TOOTH}
    defaults |= {"teeth": teeth} if gear is None else {"gear": gear}
    if not source.described and "speed_rpm" not in options:
        defaults["speed_range_rpm"] = _ANY_RPM
    return validated(AveragingSettings, {**defaults, **options}, owner="diagnose")


def _without_gear(
    results: Mapping[str, RecordedSignature | NoMeshError], reasons: Mapping[str, str], *, teeth: int
) -> Diagnosis:
    """Return the diagnosis where the gear is not to be seen in some of the recordings."""
    present = {name: each for name, each in results.items() if isinstance(each, RecordedSignature)}
    first, *others = present.values() if present else (None,)
    notes = () if first is None else tuple(reading_notes(first, others))
    healthy = [each for name, each in present.items() if name != "recording"]
    return unjudged(present.get("recording"), healthy, reasons, teeth=teeth, reading=notes)


def _loads(
    run: Candidate,
    others: Sequence[Candidate],
    *,
    torque: float | None,
    healthy_torque: Sequence[float],
    load: float | None,
    healthy_load: Sequence[float],
) -> tuple[float | None, list[float | None], tuple[Note, ...]]:
    """Return the torque, or the load, of the recording and of each healthy one, and a note where some are unknown.

    Options win over what the recordings state in their side files. Torques are taken where all are known, otherwise
    loads; where neither are, the load of the recording cannot be compared with those of the healthy recordings.
    """
    for name, values in (("healthy_torque", healthy_torque), ("healthy_load", healthy_load)):
        if values and len(values) != len(others):
            raise InputError(f"{name} has {len(values)} values for {len(others)} healthy recordings; give one of each")
    torques: list[float | None] = [run.torque if torque is None else torque]
    torques += healthy_torque or [each.torque for each in others]
    loads: list[float | None] = [run.load if load is None else load]
    loads += healthy_load or [each.load for each in others]
    if not all(isfinite(value) for value in (*torques, *loads) if value is not None):
        raise InputError("a torque or a load is no finite number; give numbers")
    for all_of_one_kind in (loads, torques) if load is not None or healthy_load else (torques, loads):
        if all(value is not None for value in all_of_one_kind):
            return all_of_one_kind[0], all_of_one_kind[1:], ()
    stated = [value for value in (*torques, *loads) if value is not None]
    notes = [_SOME_LOADS] if others and stated else []
    return None, [None] * len(others), tuple(notes)


_SOME_LOADS = Note(
    code="some-loads-unknown",
    text="The torque or the load of some of the recordings is stated, but not of all in one of the two, so the "
    "reference is not interpolated in load. State it of each, as an option or as torque or load in a side file.",
)


def _split_options(
    options: Mapping[str, object], recordings: Sequence[AnyRecording]
) -> tuple[FileOptions, dict[str, object]]:
    """Return the options of reading and those of averaging; a field of both is an option of averaging."""
    averaging = {name: value for name, value in options.items() if name not in _READING}
    reading = {name: value for name, value in options.items() if name in _READING}
    if reading and all(isinstance(source, Recording | RecordingBlocks) for source in recordings):
        raise InputError(
            f"{', '.join(reading)}: options of reading a file, and no recording is a path; give them to read_recording"
        )
    return cast(FileOptions, reading), averaging


def _read(recording: AnyRecording, options: FileOptions) -> Recording | RecordingBlocks:
    if isinstance(recording, Recording | RecordingBlocks):
        return recording
    return read_of_any_size(Path(recording), **options)
