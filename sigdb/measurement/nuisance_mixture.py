"""The law of a machine's nuisances: none, one of them, or all at once, each large or small.

No machine is wrong in every way. A law with all nuisances at once would explain away damage that none of them makes;
under a mixture an average says itself which one it has. Stated numbers are guesses themselves: with a small probability
a nuisance is twice as large.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.measurement.nuisance import NuisanceSettings

SIZES, LARGE = (1.0, 1 / 3), 2.0
"""Sizes of a nuisance over what is stated: usual ones of equal probability, and one of a probability that is stated."""

MOST_LATE = 0.49
"""Tooth passes by which a mark may be late: half a pass is that of another tooth."""


class NuisancePart(NamedTuple):
    """A part of the mixture.

    Attributes
    ----------
    weight
        Its probability.
    nuisances
        Numbers of the nuisances that a machine of this part has.
    size
        Their size over what is stated.
    late
        Whether the mark is out of its place.
    """

    weight: float
    nuisances: tuple[int, ...] = ()
    size: float = 1.0
    late: bool = False


@dataclass(frozen=True, kw_only=True)
class NuisanceMixture:
    """The parts of the law of nuisances.

    Attributes
    ----------
    parts
        The parts, whose weights add up to 1.
    mark
        Standard deviation of the mark's place, tooth passes; 0 where it is known.
    """

    parts: tuple[NuisancePart, ...]
    mark: float = 0.0

    @classmethod
    def of(cls, settings: NuisanceSettings) -> Self:
        """The mixture that a section ``[nuisance]`` states."""
        count, late = len(settings.each), settings.mark > 0
        if not (count or late):
            return cls(parts=(NuisancePart(1.0),))
        together = settings.together if count > 1 else 0.0
        alone = count + late
        weight = (1 - settings.none - together) / alone
        parts = [NuisancePart(settings.none), *([NuisancePart(weight, late=True)] if late else [])]
        usual = (1 - settings.twice) / len(SIZES)
        for size, share in ((SIZES[0], usual), (SIZES[1], usual), (LARGE, settings.twice)):
            parts += [NuisancePart(weight * share, (number,), size, late) for number in range(count)]
            parts.append(NuisancePart(together * share, tuple(range(count)), size, late))
        return cls(parts=tuple(part for part in parts if part.weight > 0), mark=settings.mark)

    @classmethod
    def certain(cls, nuisances: int, mark: float = 0.0) -> Self:
        """The law of a machine that is known to have all of some nuisances, of the stated size."""
        return cls(parts=(NuisancePart(1.0, tuple(range(nuisances)), late=mark > 0),), mark=mark)

    @property
    def plain(self) -> tuple[tuple[float, tuple[int, ...], float, bool], ...]:
        """The parts as plain tuples."""
        return tuple((part.weight, part.nuisances, part.size, part.late) for part in self.parts)

    def draw(self, stream: np.random.Generator, rows: int) -> tuple[IntArray, FloatArray]:
        """Draw the number of the part of each of some machines, and by how many tooth passes its mark is late."""
        part = stream.choice(len(self.parts), rows, p=[part.weight for part in self.parts])
        passes = np.clip(self.mark * stream.standard_normal(rows), -MOST_LATE, MOST_LATE)
        return part, passes * np.array([part.late for part in self.parts])[part]

    def factors(self, counts: Sequence[int]) -> FloatArray:
        """Return the factor of each mode in each part, (parts, modes), for so many modes of each nuisance."""
        number = np.repeat(np.arange(len(counts)), np.array(counts, int))
        return np.stack([part.size * np.isin(number, part.nuisances) for part in self.parts])
