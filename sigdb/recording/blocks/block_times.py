"""Times of consecutive blocks of a recording: they go on without a leap, and give one sampling rate."""

from dataclasses import dataclass, field

import numpy as np

from sigdb.core import InputError

SAME_RATE = 1e-3
"""Relative difference up to which the rates of two blocks are equal."""

_LEAP = 0.5
"""Distance of a block from where the one before ends, in samples, from which on its times leap."""


@dataclass(frozen=True, kw_only=True)
class BlockTime:
    """Times of a block.

    Attributes
    ----------
    first
        Number of its first sample.
    size
        Number of its samples.
    start
        Time of its first sample, s; None where the file states no times.
    sampling_rate
        Sampling rate by its own times, Hz.
    resolution
        Resolution of rounded times, s; else 0.
    """

    first: int
    size: int
    start: float | None
    sampling_rate: float
    resolution: float = 0.0

    @property
    def middle(self) -> float:
        """Number of the sample in its middle."""
        return self.first + (self.size - 1) / 2


@dataclass
class BlockTimes:
    """Times of blocks that follow each other."""

    blocks: list[BlockTime] = field(default_factory=list)

    def take(self, block: BlockTime) -> None:
        """Take the next block.

        Raises
        ------
        InputError
            If its times do not go on where those of the block before end, or its rate is another.
        """
        if self.blocks:
            _check(self.blocks[0], self.blocks[-1], block)
        self.blocks.append(block)

    def slope_rate(self) -> float:
        """Return the sampling rate in Hz: the slope of the straight line through all times by least squares.

        Raises
        ------
        InputError
            If a block lies off that line by half a sample: samples are missing before it.
        """
        blocks, first = self.blocks, self.blocks[0]
        total = sum(block.size for block in blocks)
        if len(blocks) == 1 or first.start is None:
            return first.sampling_rate
        centre = (total - 1) / 2
        # Times after a line through the first block: small numbers, which rounding hurts least.
        step = 1 / first.sampling_rate
        offsets = [_middle_time(block) - first.start - block.middle * step for block in blocks]
        mean = sum(block.size * offset for block, offset in zip(blocks, offsets, strict=True)) / total
        slope = sum(
            block.size * (block.middle - centre) * (offset - mean)
            + block.size * (block.size**2 - 1) / 12 * (1 / block.sampling_rate - step)
            for block, offset in zip(blocks, offsets, strict=True)
        ) / (total * (total**2 - 1) / 12)
        for block, offset in zip(blocks, offsets, strict=True):
            off = offset - mean - slope * (block.middle - centre)
            if abs(off) > _LEAP * step + block.resolution:
                raise InputError(
                    f"the times about {_middle_time(block):.9g} s, sample {block.middle:.0f}, are "
                    f"{abs(off) / step:.3g} steps away from even times; resample the recording, or give sampling_rate "
                    "and time=false if the times are wrong"
                )
        # Starts since 1970 are rounded to 0.2 us: a slope within that is none.
        rounding = 4 * np.spacing(max(abs(block.start or 0.0) for block in blocks)) / total
        return first.sampling_rate if abs(slope) <= rounding else 1 / (step + slope)


def _middle_time(block: BlockTime) -> float:
    return (block.start or 0.0) + (block.size - 1) / 2 / block.sampling_rate


def _check(first: BlockTime, before: BlockTime, block: BlockTime) -> None:
    """Refuse a block that does not go on from the one before."""
    rate = first.sampling_rate
    when = f"at sample {block.first}" + ("" if block.start is None else f", {block.start:.9g} s")
    if abs(block.sampling_rate / rate - 1) > SAME_RATE + block.resolution * rate / block.size * 3:
        raise InputError(
            f"the sampling rate changes from {rate:.9g} to {block.sampling_rate:.9g} Hz {when}; cut the recording there"
        )
    if (before.start is None) != (block.start is None):
        raise InputError(f"the times end or begin {when}; cut the recording there")
    if before.start is None or block.start is None:
        return
    expected = before.start + before.size / before.sampling_rate
    leap = block.start - expected
    if abs(leap) > _LEAP / rate + 2 * block.resolution:
        what = "samples are missing there" if leap > 0 else "the times go back there"
        raise InputError(
            f"the times leap by {leap:.6g} s ({abs(leap) * rate:.3g} steps) {when}: {what}; cut the recording in two"
        )
