"""Channels of MDF version 4: their bits in the records, and the conversions to physical numbers."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray
from sigdb.recording.files.formats.contents import StoredArray
from sigdb.recording.files.formats.mdf4_blocks import Block, Blocks

FIXED, MASTER, VIRTUAL_MASTER = 0, 2, 3
TIME = 1
SYNCHRONISED_WITH = {TIME: "time", 2: "angle", 3: "distance", 4: "index"}
UNSIGNED, SIGNED, FLOAT = (0, 1), (2, 3), (4, 5)
BIG_ENDIAN = (1, 3, 5)
ALL_INVALID, HAS_INVALIDATION_BIT = 1, 2


class UnreadChannelError(Exception):
    """A channel cannot be read; the message completes "NAME"."""


@dataclass(frozen=True, kw_only=True)
class ChannelBlock:
    """A channel: name, unit, kind, and the place of its bits in a record.

    ``conversion`` is the byte at which the block of its conversion begins, 0 if there is none.
    """

    name: str
    unit: str
    kind: int
    synchronised: int
    data_type: int
    bit: int
    byte: int
    bits: int
    flags: int
    invalidation_bit: int
    conversion: int
    composed: bool


def channel_block(blocks: Blocks, block: Block) -> ChannelBlock:
    """Return the channel that a block CN describes."""
    kind, synchronised, data_type, bit = block.unpack("<4B")
    byte, bits, flags, invalidation_bit = block.unpack("<4I", 4)
    conversion = block.link(4)
    unit = blocks.text(block.link(6))
    if not unit and conversion:
        unit = blocks.text(blocks.at(conversion, "CC").link(1))
    return ChannelBlock(
        name=blocks.text(block.link(2)), unit=unit, kind=kind, synchronised=synchronised, data_type=data_type, bit=bit,
        byte=byte, bits=bits, flags=flags, invalidation_bit=invalidation_bit, conversion=conversion,
        composed=bool(block.link(1)),
    )  # fmt: skip


def values(
    channel: ChannelBlock, table: StoredArray, data_bytes: int, blocks: Blocks, *, first: int = 0
) -> StoredArray:
    """Return the physical numbers of a channel, nan where they are invalid.

    Parameters
    ----------
    channel
        The channel.
    table
        (records, bytes) records; the invalidation bits are behind the data.
    data_bytes
        Bytes of the data in a record.
    blocks
        Blocks of the file, for the conversion.
    first
        Number of the first of the records in the file.

    Raises
    ------
    UnreadChannelError
        If the channel holds no numbers, or has a conversion that is not read.
    """
    if channel.kind == VIRTUAL_MASTER:
        return converted(first + np.arange(len(table), dtype=float), channel.conversion, blocks)
    if channel.kind not in (FIXED, MASTER):
        raise UnreadChannelError("has no numbers of a fixed length")
    if channel.composed:
        raise UnreadChannelError("is an array or a structure")
    if channel.flags & ALL_INVALID:
        raise UnreadChannelError("states that all its numbers are invalid")
    physical = converted(_stored(channel, table[:, :data_bytes]), channel.conversion, blocks)
    if channel.flags & HAS_INVALIDATION_BIT:
        byte, bit = divmod(channel.invalidation_bit, 8)
        if data_bytes + byte >= table.shape[1]:
            raise UnreadChannelError("has its invalidation bit outside the record")
        invalid = (table[:, data_bytes + byte] >> bit & 1).astype(bool)
        if invalid.any():
            physical = np.where(invalid, np.nan, physical)
    return physical


def _stored(channel: ChannelBlock, data: StoredArray) -> StoredArray:
    """Return the numbers as they are stored."""
    if channel.data_type not in UNSIGNED + SIGNED + FLOAT:
        raise UnreadChannelError("holds text or bytes, not numbers")
    size = (channel.bit + channel.bits + 7) // 8
    if not 0 < channel.bits <= 64 or channel.bit > 7 or size > 8 or channel.byte + size > data.shape[1]:
        raise UnreadChannelError("has its bits outside the record")
    part = data[:, channel.byte : channel.byte + size]
    if channel.data_type in BIG_ENDIAN:
        part = part[:, ::-1]
    if channel.data_type in FLOAT:
        if channel.bit or channel.bits not in (16, 32, 64):
            raise UnreadChannelError(f"holds floating-point numbers of {channel.bits} bits")
        return np.ascontiguousarray(part).reshape(-1).view(f"<f{size}")
    letter = "u" if channel.data_type in UNSIGNED else "i"
    if not channel.bit and channel.bits in (8, 16, 32, 64):
        return np.ascontiguousarray(part).reshape(-1).view(f"<{letter}{size}")
    whole = np.zeros((len(part), 8), np.uint8)
    whole[:, :size] = part
    number: StoredArray = whole.reshape(-1).view("<u8") << np.uint64(64 - channel.bit - channel.bits)
    return number.view(f"<{letter}8") >> np.array(64 - channel.bits, f"{letter}8")


def converted(stored: StoredArray, conversion: int, blocks: Blocks) -> StoredArray:
    """Return the physical numbers by the conversion whose block begins at a byte; stored ones if there is none."""
    if not conversion:
        return stored
    block = blocks.at(conversion, "CC")
    kind, _, _, _, count = block.unpack("<BBHHH")
    if 24 + 8 * count > len(block.body):
        raise UnreadChannelError("has a conversion that is not complete")
    p = np.frombuffer(block.body, "<f8", count, 24)
    if kind == 0:
        return stored
    x: FloatArray = stored.astype(float)
    if not np.isfinite(p).all():
        raise UnreadChannelError("has a conversion with numbers that are not finite")
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # what is not finite is refused later
        if kind == 1 and count == 2:
            return p[0] + p[1] * x
        if kind == 2 and count == 6:
            above, below = (p[i] * x**2 + p[i + 1] * x + p[i + 2] for i in (0, 3))
            return np.asarray(above / below)
    keys, outputs = p[::2], p[1::2]
    if kind == 4 and keys.size == outputs.size > 0 and (np.diff(keys) > 0).all():
        return np.interp(x, keys, outputs)
    words = {3: "a formula", 5: "a table without interpolation", 6: "a table of ranges", 7: "texts", 8: "texts"}
    raise UnreadChannelError(f"has a conversion by {words.get(kind, f'method {kind}')}, which is not read")
