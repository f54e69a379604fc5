"""Segments: rows of one template, as arrays. Row ids run through the segments in order."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sigdb.core.typing import IntArray


@dataclass(frozen=True, kw_only=True)
class Segments:
    """Products of teeth, measurements, specimens and noise draws, the last fastest, each of one template.

    Attributes
    ----------
    template
        (segments,) number of the template.
    tooth_start, tooth_count
        (segments,) where the segment's teeth stand in ``teeth``, and how many there are.
    measured_start, measured_count
        (segments,) the same of its measurements in ``measured``.
    draws
        (segments,) noise draws of each specimen.
    specimens
        Specimens of every segment.
    teeth, measured
        Numbers of teeth, and of measurements, which segments share.
    """

    template: NDArray[np.int32]
    tooth_start: NDArray[np.int32]
    tooth_count: NDArray[np.int32]
    measured_start: NDArray[np.int32]
    measured_count: NDArray[np.int32]
    draws: IntArray
    specimens: int
    teeth: IntArray
    measured: NDArray[np.int32]

    @cached_property
    def first(self) -> IntArray:
        """(segments + 1,) first row of each, and the number of rows at the end."""
        each = self.tooth_count.astype(np.int64) * self.measured_count * self.specimens * self.draws
        return np.concatenate([np.zeros(1, np.int64), np.cumsum(each)])

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.first[-1])

    def located(self, rows: IntArray) -> dict[str, IntArray]:
        """Template, tooth, measurement, specimen and draw of rows."""
        segment = np.searchsorted(self.first, rows, side="right") - 1
        within, draw = np.divmod(rows - self.first[segment], self.draws[segment])
        within, specimen = np.divmod(within, self.specimens)
        tooth, measured = np.divmod(within, self.measured_count[segment])
        return {
            "template": self.template[segment].astype(np.int64),
            "tooth": self.teeth[self.tooth_start[segment] + tooth],
            "measured": self.measured[self.measured_start[segment] + measured].astype(np.int64),
            "specimen": specimen,
            "draw": draw,
        }
