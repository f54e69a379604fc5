"""MDF version 4 (MF4): channels of measurements with the times of their groups; no bus messages."""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from mmap import ACCESS_READ, mmap
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
    StoredArray,
    bounded_bytes,
    check_bytes,
    check_columns,
    check_values,
)
from sigdb.recording.files.formats.mdf4_blocks import FIRST_BLOCK, Block, Blocks, RecordBytes
from sigdb.recording.files.formats.mdf4_channels import (
    MASTER,
    SYNCHRONISED_WITH,
    TIME,
    VIRTUAL_MASTER,
    ChannelBlock,
    UnreadChannelError,
    channel_block,
    values,
)
from sigdb.recording.files.formats.named_arrays import not_read
from sigdb.recording.files.formats.sample_window import WHOLE, SampleWindow, window_blocks
from sigdb.recording.files.sampling_rates import HIGHEST, LOWEST
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.files.time_base import EVEN, refuse_coarse, time_base
from sigdb.recording.files.time_names import seconds_of

FOREIGN: tuple[type[Exception], ...] = ()

MOST_RECORDS = 2**24
"""Largest number of records of an unsorted data group, which are read one by one."""

OF_TEXT, OF_BUS, REMOTE_MASTER = 1, 2, 8


@dataclass(frozen=True, kw_only=True)
class _Group:
    """A channel group: its channels, its records, and the byte of the block of the group whose master it shares."""

    name: str
    id: int
    cycles: int
    flags: int
    data_bytes: int
    invalidation_bytes: int
    channels: tuple[ChannelBlock, ...]
    remote: int

    @property
    def size(self) -> int:
        """Bytes of a record."""
        return self.data_bytes + self.invalidation_bytes


@dataclass(frozen=True, kw_only=True)
class _Axis:
    """Quantity along the samples of a group; for times their rate in Hz, and the first of them in s."""

    abscissa: str = "time"
    sampling_rate: float | None = None
    start: float | None = None


@dataclass(frozen=True, kw_only=True)
class _Records:
    """The records of a group: their count, the bytes before each, and their bytes, or the records that were sorted."""

    group: _Group
    count: int
    lead: int
    data: RecordBytes | StoredArray

    def table(self, window: SampleWindow) -> StoredArray:
        """Return the (records, bytes) in a window."""
        part = window.of(self.count)
        if isinstance(self.data, np.ndarray):
            return self.data[part]
        size = self.lead + self.group.size
        stored = np.frombuffer(self.data.part(part.start * size, part.stop * size), np.uint8)
        return stored.reshape(-1, size)[:, self.lead :]


_Tables = dict[int, _Records]
"""The records of each group, by the byte at which its block begins."""


def read_mdf4(path: Path, settings: RecordingSettings) -> Contents:
    """Read the channels of all groups; ``variable`` is the name of a group.

    The sampling rate is that of the times of the group, and the start is the first of them.
    """
    return _MdfFile(memoryview(bounded_bytes(path)), settings, is_whole=True).contents(WHOLE)


def mdf4_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the channels of all groups in blocks; the records of each data group must be of one group.

    Parameters
    ----------
    path
        The file.
    settings
        Settings of reading; variable is a group.
    samples
        Samples of a block.
    """
    with path.open("rb") as stored:
        file = _MdfFile(memoryview(mmap(stored.fileno(), 0, access=ACCESS_READ)), settings, is_whole=False)
    return window_blocks(file.contents, samples, starts_of_file=settings.sampling_rate is not None)


class _MdfFile:
    """A file and the groups in it; those without usable times in the first window are left out of all."""

    def __init__(self, data: memoryview, settings: RecordingSettings, *, is_whole: bool) -> None:
        _check_version(bytes(data[:FIRST_BLOCK]))
        self._blocks, self._settings = Blocks(data), settings
        self._notes: list[Note] = []
        self._tables = _tables(self._blocks, self._notes, is_whole=is_whole)
        self._left_out: set[int] = set()
        if is_whole:
            check_bytes(self._blocks.record_bytes)

    def contents(self, window: SampleWindow) -> Contents:
        """Return the samples of all channels in a window."""
        settings, notes = self._settings, [*self._notes]
        columns: list[tuple[str, DataColumn]] = []
        total = 0
        for start, records in self._tables.items():
            group = records.group
            if settings.variable not in (None, group.name) or start in self._left_out:
                continue
            table = records.table(window)
            total += len(table) * len(group.channels)
            check_values(total)
            check_columns(len(columns) + len(group.channels))
            axis = self._axis(start, window, notes) if len(table) else _Axis()
            if axis is None:
                self._left_out.add(start)
                continue
            first = window.of(records.count).start
            for channel in group.channels:
                if channel.kind in (MASTER, VIRTUAL_MASTER):
                    continue
                try:
                    numbers = values(channel, table, group.data_bytes, self._blocks, first=first)
                except UnreadChannelError as error:
                    notes.append(Note(code="channel-left-out", text=f"{channel.name} {error}, and was left out"))
                    continue
                column = DataColumn(
                    name=channel.name, values=numbers, unit=channel.unit, sampling_rate=axis.sampling_rate,
                    rate_from=f"the times of {group.name}", start=axis.start, abscissa=axis.abscissa,
                )  # fmt: skip
                columns.append((group.name, column))
        if not columns:
            others = "".join(f"; {note.text}" for note in notes[:3])
            where = f" in a group {settings.variable!r}" if settings.variable else ""
            raise InputError(f"holds no channels of numbers{where}{others}")
        return Contents(columns=_with_names(columns), notes=tuple(notes))

    def _axis(self, start: int, window: SampleWindow, notes: list[Note]) -> _Axis | None:
        """Return what a group's samples follow, None if it is left out, and add notes."""
        group = self._tables[start].group
        try:
            axis, axis_notes = _axis(self._tables, start, self._blocks, self._settings, window)
        except InputError as error:
            if self._is_chosen(group):
                raise
            if window.first:
                return _Axis()
            self._notes.append(Note(code="group-left-out", text=f"{group.name} was left out: {error}"))
            notes.append(self._notes[-1])
            return None
        notes += axis_notes
        return axis

    def _is_chosen(self, group: _Group) -> bool:
        """Return whether the settings choose a channel of a group, by a name that no other group has."""
        chosen = self._settings.channels or ()
        others = [records.group for records in self._tables.values() if records.group is not group]
        elsewhere = {channel.name for other in others for channel in other.channels}
        return any(
            f"{group.name}/{channel.name}" in chosen or (channel.name in chosen and channel.name not in elsewhere)
            for channel in group.channels
        )


def _check_version(head: bytes) -> None:
    if head.startswith(b"UnFinMF"):
        raise InputError("was not closed by its recorder; finalize it with the recorder's software")
    version = head[8:16].split(b"\0")[0].strip().decode("latin-1")
    if not version.startswith("4") or len(head) < FIRST_BLOCK:
        raise InputError(f"is MDF of version {version or '?'}, and version 4 is read; convert it")


def _tables(blocks: Blocks, notes: list[Note], *, is_whole: bool) -> _Tables:
    """Return all groups of measurements with their records, and add notes on others."""
    tables: _Tables = {}
    for _, data_group in blocks.chain(blocks.at(FIRST_BLOCK, "HD").link(0), "DG"):
        groups: dict[int, _Group] = {}
        for start, block in blocks.chain(data_group.link(1), "CG"):
            group = _group(blocks, block)
            groups[start] = replace(group, name=group.name or f"group {len(tables) + len(groups) + 1}")
        measured = {start: group for start, group in groups.items() if not group.flags & (OF_TEXT | OF_BUS)}
        notes += [
            not_read(group.name, "a group of bus messages, so no channels")
            for group in groups.values()
            if group.flags & OF_BUS
        ]
        if not measured or not data_group.link(2):
            continue
        (id_size,) = data_group.unpack("<B")
        records = _records(blocks.records(data_group.link(2)), id_size, list(groups.values()), is_whole=is_whole)
        for start, group in measured.items():
            count = records[group.id].count
            if count < group.cycles:
                text = f"{group.name} states {group.cycles} records and holds {count}: the file is cut short"
                notes.append(Note(code="cut-short", text=text, values={"stated": group.cycles, "read": count}))
            if count:
                tables[start] = replace(records[group.id], group=group)
    return tables


def _group(blocks: Blocks, block: Block) -> _Group:
    id_, cycles = block.unpack("<QQ")
    (flags,) = block.unpack("<H", 16)
    data_bytes, invalidation_bytes = block.unpack("<II", 24)
    return _Group(
        name=blocks.text(block.link(2)), id=id_, cycles=cycles, flags=flags, data_bytes=data_bytes,
        invalidation_bytes=invalidation_bytes, remote=block.link(6) if flags & REMOTE_MASTER else 0,
        channels=tuple(channel_block(blocks, channel) for _, channel in blocks.chain(block.link(1), "CN")),
    )  # fmt: skip


def _records(data: RecordBytes, id_size: int, groups: list[_Group], *, is_whole: bool) -> dict[int, _Records]:
    """Return the records of each group by its number; before each record stands the number of its group."""
    if id_size not in (0, 1, 2, 4, 8) or (id_size == 0 and len(groups) > 1):
        raise InputError(f"is damaged: numbers of groups have {id_size} bytes")
    if len(groups) == 1:
        (group,) = groups
        size = id_size + group.size
        count = min(data.size // size, group.cycles) if group.size else 0
        return {group.id: _Records(group=group, count=count, lead=id_size, data=data)}
    if not is_whole:
        raise InputError("holds records of several groups in turn, which are not read in blocks; sort it, or cut it")
    check_bytes(data.size)
    by_id = {group.id: group for group in groups}
    tables = _sorted(bytes(data.part(0, data.size)), id_size, by_id)
    return {i: _Records(group=by_id[i], count=len(table), lead=0, data=table) for i, table in tables.items()}


def _sorted(data: bytes, id_size: int, groups: dict[int, _Group]) -> dict[int, StoredArray]:
    """Return the records of groups that follow each other in any order."""
    begins: dict[int, list[int]] = {number: [] for number in groups}
    number_at = struct.Struct({1: "<B", 2: "<H", 4: "<I", 8: "<Q"}[id_size]).unpack_from
    at, count = 0, 0
    while at + id_size <= len(data):
        (number,) = number_at(data, at)
        at += id_size
        if number not in groups:
            raise InputError(f"is damaged: a record belongs to group {number}, which is not there")
        group = groups[number]
        if group.flags & OF_TEXT:
            at += 4 + int.from_bytes(data[at : at + 4], "little")
        elif at + group.size <= len(data):
            begins[number].append(at)
            at += group.size
        else:
            break
        count += 1
        if count > MOST_RECORDS:
            raise InputError(f"holds more than {MOST_RECORDS} records that are not sorted; sort it, or cut it")
    everything = np.frombuffer(data, np.uint8)
    return {
        number: sliding_window_view(everything, group.size)[np.array(begins[number][: group.cycles], int)]
        if begins[number] and group.size
        else np.zeros((0, group.size), np.uint8)
        for number, group in groups.items()
    }


def _axis(
    tables: _Tables, start: int, blocks: Blocks, settings: RecordingSettings, window: SampleWindow
) -> tuple[_Axis, list[Note]]:
    """Return what a group's samples follow, by its own master or that of another group, and notes."""
    records = tables[start]
    group, of_owner = records.group, tables.get(records.group.remote, records) if records.group.remote else records
    owner = of_owner.group
    master = next((channel for channel in owner.channels if channel.kind in (MASTER, VIRTUAL_MASTER)), None)
    if master is None or of_owner.count != records.count:
        return _Axis(), []
    if master.synchronised != TIME:
        what = SYNCHRONISED_WITH.get(master.synchronised, "an unknown quantity")
        return (_Axis() if what == "index" else _Axis(abscissa=f"{what} ({master.name})")), []
    window = window if settings.sampling_rate is None else SampleWindow(0, 1)  # the start only
    try:
        first = window.of(records.count).start
        times = values(master, of_owner.table(window), owner.data_bytes, blocks, first=first).astype(float)
    except UnreadChannelError as error:
        raise InputError(f"its times {master.name} cannot be read: it {error}") from None
    times = times * (seconds_of(master.unit) or 1.0)
    if settings.sampling_rate is not None:
        return _Axis(start=float(times[0]) if np.isfinite(times[0]) else None), []
    name = f"{master.name} of {group.name}"
    base = time_base(times, name=name)
    refuse_coarse(base, name=name)
    if not LOWEST < base.sampling_rate <= HIGHEST:
        raise InputError(f"it has {base.sampling_rate:.6g} Hz, at which no vibration is sampled")
    notes = []
    if base.resolution:
        text = f"{name} is rounded to {base.resolution:.3g} s; the rate is the slope of its times"
        notes.append(Note(code="rounded-times", text=text, values={"column": name, "resolution": base.resolution}))
    elif base.jitter > EVEN:
        text = f"{name} is up to {base.jitter:.2g} steps away from even times, which were taken"
        notes.append(Note(code="uneven-times", text=text, values={"column": name, "steps": base.jitter}))
    return _Axis(sampling_rate=base.sampling_rate, start=base.start), notes


def _with_names(columns: list[tuple[str, DataColumn]]) -> tuple[DataColumn, ...]:
    """Return the columns; a name that stands in several groups is preceded by that of its group."""
    count = Counter(column.name for _, column in columns)
    return tuple(
        replace(column, name=f"{group}/{column.name}") if count[column.name] > 1 else column
        for group, column in columns
    )
