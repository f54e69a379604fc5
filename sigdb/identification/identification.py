"""The result of an identification: rigs that meet the targets, what these say of each number, and predictions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr

from sigdb.core import FloatArray, JsonValue, plain
from sigdb.identification.problem import Problem
from sigdb.transmission import Range, Transmission

if TYPE_CHECKING:
    import pandas as pd

LEVEL = 0.95
"""Probability of an interval, if there are enough members."""
NOT_IDENTIFIED = 0.8
"""Width of a posterior interval over that of the prior, above which the targets do not identify a number."""
MET = 9.0
"""Mean square of the misses, in standard deviations, up to which a rig meets the targets."""


@dataclass(frozen=True, kw_only=True)
class Member:
    """A rig of the ensemble.

    Attributes
    ----------
    z
        (d,) coordinates of its free numbers.
    rig
        The rig.
    misfit
        Mean square of its misses of the targets as they were drawn for it, in standard deviations.
    predicted
        (m,) what would be measured of it.
    observed
        (k,) the observed numbers; nan where there is none.
    """

    z: FloatArray
    rig: Transmission
    misfit: float
    predicted: FloatArray
    observed: FloatArray


@dataclass(frozen=True, kw_only=True, repr=False)
class Identification:
    """Rigs that meet stated targets: draws of the posterior.

    Attributes
    ----------
    problem
        The rig with its ranges, and the targets.
    members : tuple of Member
        The rigs.
    left_out : dict
        Number of draws that cannot be rigs, by reason.
    """

    problem: Problem
    members: tuple[Member, ...]
    left_out: Mapping[str, int]

    def __repr__(self) -> str:
        return (
            f"<Identification of {self.problem.rig.name!r}: {len(self.members)} rigs, "
            f"{sum(self.meets_targets)} of which meet the targets>"
        )

    @property
    def level(self) -> float:
        """Probability of the intervals: 0.95, or less with fewer than 39 members."""
        count = len(self.members)
        return min(LEVEL, (count - 1) / (count + 1))

    @property
    def meets_targets(self) -> tuple[bool, ...]:
        """Whether each member meets the targets: its mean square miss is at most 9, and its observations hold."""
        observations = self.problem.targets.observations
        return tuple(
            member.misfit <= MET
            and all(
                observation.held_out or observation.holds(number)
                for observation, number in zip(observations, member.observed, strict=True)
            )
            for member in self.members
        )

    @property
    def rigs(self) -> tuple[Transmission, ...]:
        """The rigs of the members."""
        return tuple(member.rig for member in self.members)

    def table(self) -> "pd.DataFrame":
        """Return the values of the members' free numbers and their misfits: a row a member."""
        import pandas as pd

        values = [self.problem.values_at(member.z) for member in self.members]
        frame = pd.DataFrame(values, columns=list(dict.fromkeys(self.problem.paths))).rename_axis(index="member")
        return frame.assign(misfit=[member.misfit for member in self.members], meets_targets=self.meets_targets)

    def coordinates(self) -> "pd.DataFrame":
        """Return the place of the members' numbers in their ranges, from 0 to 1: a row a member, a column a number."""
        import pandas as pd

        u = ndtr(np.array([member.z for member in self.members]))
        free = self.problem.rig.assumptions.free
        ranged = [i for i, number in enumerate(free) if isinstance(number.assumption, Range) and number.within is None]
        return pd.DataFrame(u[:, ranged], columns=[free[i].path for i in ranged]).rename_axis(index="member")

    def posterior(self) -> "pd.DataFrame":
        """Return what the targets say of each number: a row a number, by its dotted path.

        ``low`` and ``high`` are the ends of its range, ``posterior_low`` and ``posterior_high`` those of its interval.
        ``width`` is the interval's width over that of the prior, both along the scale of the range: near 1 the targets
        do not identify the number. Choices, and numbers of tables that can be chosen, are in :meth:`table` only.
        """
        import pandas as pd

        table, coordinates = self.table(), self.coordinates()
        rows = []
        for path in map(str, coordinates):
            assumption = self.problem.rig.assumptions[path]
            assert isinstance(assumption, Range)
            low, median, high = self._interval(table[path].to_numpy())
            start, _, end = self._interval(coordinates[path].to_numpy())
            width = (end - start) / self.level
            rows.append((path, assumption.low, assumption.high, low, median, high, width, width <= NOT_IDENTIFIED))
        names = ["number", "low", "high", "posterior_low", "median", "posterior_high", "width", "is_identified"]
        return pd.DataFrame(rows, columns=names).set_index("number")

    def predictions(self) -> "pd.DataFrame":
        """Return what the members say of each measured number: a row a number, fitted ones and those held out."""
        import pandas as pd

        predicted = np.array([member.predicted for member in self.members])
        rows = [
            (number.label, number.unit, number.value, number.error, *self._interval(column), number.held_out)
            for number, column in zip(self.problem.targets.quantities, predicted.T, strict=True)
        ]
        names = ["quantity", "unit", "stated", "error", "predicted_low", "median", "predicted_high", "held_out"]
        return pd.DataFrame(rows, columns=names).set_index("quantity")

    def observations(self) -> "pd.DataFrame":
        """Return what the members say of each observation, and the share of them in which it holds: a row each."""
        import pandas as pd

        observed = np.array([member.observed for member in self.members])
        rows = []
        for observation, column in zip(self.problem.targets.observations, observed.T, strict=True):
            numbers = column[np.isfinite(column)]
            band = self._interval(numbers) if len(numbers) else (np.nan, np.nan, np.nan)
            share = float(np.mean([observation.holds(number) for number in column]))
            rows.append((observation.label, observation.below, observation.above, *band, share, observation.held_out))
        names = ["observation", "below", "above", "low", "median", "high", "holds_in", "held_out"]
        return pd.DataFrame(rows, columns=names).set_index("observation")

    def as_json(self) -> dict[str, JsonValue]:
        """Return the result as plain values."""
        frames = {"members": self.table(), "posterior": self.posterior(), "predictions": self.predictions()}
        frames |= {"observations": self.observations()}
        tables = {name: plain(frame.reset_index().to_dict("records")) for name, frame in frames.items()}
        return {
            "rig": self.problem.rig.name,
            "targets": self.problem.targets.title,
            "level": self.level,
            "left_out": plain(self.left_out),
            **tables,
        }

    def _interval(self, values: FloatArray) -> tuple[float, float, float]:
        """Return the low end, the median and the high end of values (members,)."""
        tail = (1 - self.level) / 2
        low, median, high = np.quantile(values, [tail, 0.5, 1 - tail], method="weibull")
        return float(low), float(median), float(high)
