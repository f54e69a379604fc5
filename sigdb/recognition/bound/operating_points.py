"""Rows of a database by operating point, each with the hypotheses that its rows may come from."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import log_softmax, logsumexp

from sigdb.core import FloatArray, IntArray, NotApplicableError, blocks, validated
from sigdb.database import (
    QUANTITIES,
    Database,
    damage_columns,
    damage_kinds,
    database_quantities,
    severity_levels,
    suffixed,
)
from sigdb.measurement import NuisanceSettings, coloured, drawn_colours, noise_deviation
from sigdb.recognition.noise.noise_shape import whitened
from sigdb.recognition.templates.continuous_severity import ContinuousSeverity, TemplateDistances
from sigdb.recognition.templates.hypotheses import Hypotheses
from sigdb.recognition.templates.posterior import Posterior, log_prior, posterior
from sigdb.recognition.templates.severity_grid import severity_grids, severity_interpolation

_POINT = ["speed_rpm", "torque", "teeth"]
_COLUMNS = ("id", "template", "tooth", "specimen", "averages", "snr_db", "index_error", "contact_loss")
_ROWS_AT_ONCE = 2048
"""Rows whose averages are in memory at once. Rows are drawn anew block by block, so other draws follow from it."""

Place: TypeAlias = tuple[float, float, int]
"""Speed (rpm), torque (N m) and tooth count."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OperatingPoint:
    """Rows of one operating point and tooth count.

    Attributes
    ----------
    hypotheses
        Laws that rows may follow.
    rows
        All rows inside the law, by id: ``place`` (of its template among the hypotheses), ``tooth``, ``teeth``,
        ``specimen``, ``noise`` (standard deviation of the average's noise), ``index_error``, the damage,
        ``requested`` (whether the row is one of those requested) and, where noise is coloured, ``colour``.
    known_cells
        Whether severities are those of the templates. If not, they may be any between them, where the templates show
        how signals lie there.
    quantities
        Quantities of the severity of the database.
    colours
        (colours, n / 2 + 1) deviation of the noise by order over that of white noise, for each colour that the rows may
        have; None where all noise is white. The best possible answer knows the colour of each row.
    """

    hypotheses: Hypotheses
    rows: pd.DataFrame
    known_cells: bool = True
    quantities: tuple[str, ...] = QUANTITIES
    colours: FloatArray | None = None

    @cached_property
    def severity(self) -> FloatArray:
        """(templates, quantities) severities; nan where the damage does not have a quantity, or there is a pattern."""
        return severity_levels(self.hypotheses.cases, self.quantities).to_numpy()

    @property
    def place(self) -> Place:
        """Speed (rpm), torque (N m) and tooth count."""
        return _place(self.rows)

    def log_likelihood(self, x: FloatArray, rows: pd.DataFrame) -> FloatArray:
        """Return the log-likelihood (rows, templates, teeth) of averages.

        Parameters
        ----------
        x
            (rows, n) averages.
        rows
            ``noise`` and ``index_error`` of each average, and its ``colour``.
        """
        likelihood = np.empty((len(x), len(self.hypotheses.signal), self.hypotheses.teeth))
        for laws, colour, at in self._by_colour(rows):
            of_colour = x[at] if colour is None else whitened(x[at], colour)
            likelihood[at] = laws.log_likelihood(of_colour, **_law(rows.iloc[at]))
        return likelihood

    def posterior(self, x: FloatArray, rows: pd.DataFrame) -> Posterior:
        """Return the posterior of averages; parameters as in :meth:`log_likelihood`."""
        return self.posterior_of(self.log_likelihood(x, rows), rows)

    def posterior_of(self, log_likelihood: FloatArray, rows: pd.DataFrame) -> Posterior:
        """Return the posterior of averages with this likelihood (rows, templates, teeth).

        It is that of the location alone, without templates, where severities may lie between those of the templates.
        """
        healthy = self.hypotheses.healthy
        if self.between is None:
            return posterior(log_likelihood, self.log_prior, healthy)
        evidence = self.between.evidence(log_likelihood, self.distances(self.between, rows))
        none = logsumexp(log_likelihood[:, healthy] + self.log_prior[healthy], axis=(1, 2))
        of_teeth = evidence + logsumexp(self.log_prior[~healthy], axis=0)
        location = log_softmax(np.column_stack([none, of_teeth]), axis=1)
        return Posterior(location=location, damage=np.empty((len(rows), 0)))

    def distances(self, between: ContinuousSeverity, rows: pd.DataFrame) -> list[FloatArray]:
        """Return the distances of templates, as of :meth:`ContinuousSeverity.evidence`, for averages of rows."""
        distances: list[FloatArray] = []
        for laws, _, at in self._by_colour(rows):
            for i, templates in enumerate(between.templates):
                some = TemplateDistances(laws.turned, templates).at(**_law(rows.iloc[at]))
                if i == len(distances):
                    distances.append(np.empty((len(rows), some.shape[1])))
                distances[i][at] = some
        return distances

    def _by_colour(self, rows: pd.DataFrame) -> Iterator[tuple[Hypotheses, FloatArray | None, IntArray]]:
        """Yield the laws of averages with white noise, the colour that makes it so, and the places of its rows."""
        if self.colours is None:
            yield self.hypotheses, None, np.arange(len(rows))
            return
        numbers = rows["colour"].to_numpy(int)
        for number in np.unique(numbers).tolist():
            colour = self.colours[number]
            yield self.hypotheses.whitened(colour), colour, np.flatnonzero(numbers == number)

    @property
    def between(self) -> ContinuousSeverity | None:
        """Posteriors over severities between the templates; None where severities are those of the templates."""
        return None if self.known_cells else self.continuous_severity

    def with_request(self, ids: ArrayLike) -> Self:
        """Return the same operating point with other rows requested."""
        return replace(self, rows=self.rows.assign(requested=np.isin(self.rows.index, ids)))

    @cached_property
    def requested(self) -> Self:
        """The operating point with the requested rows only and their severities, so that these are the prior."""
        return replace(self, rows=self.rows[self.rows["requested"]], known_cells=True)

    def stored(self, database: Database, sensor: str | None) -> Iterator[tuple[pd.DataFrame, FloatArray]]:
        """Yield the requested rows with their averages, some at a time."""
        wanted = self.rows[self.rows["requested"]]
        for some in blocks(len(wanted), _ROWS_AT_ONCE):
            rows = wanted.iloc[some]
            yield rows, database.signals(rows.index.to_numpy(), sensor=sensor)["tsa"]

    def redrawn(
        self, stream: np.random.Generator, draws: int, *, specimens: bool = True, decibels: float = 0.0
    ) -> Iterator[tuple[pd.DataFrame, FloatArray]]:
        """Yield rows chosen at random from all, with specimens and noise drawn anew from the law, some at a time.

        Parameters
        ----------
        stream
            Random stream.
        draws
            Number of rows.
        specimens
            Whether gears have index errors.
        decibels
            Increase of the noise, dB.
        """
        for some in blocks(draws, _ROWS_AT_ONCE):
            chosen = self.rows.iloc[stream.integers(len(self.rows), size=some.stop - some.start)]
            rows = chosen.assign(
                noise=chosen["noise"] * 10 ** (decibels / 20), index_error=chosen["index_error"] * specimens
            )
            x = np.empty((len(rows), self.hypotheses.signal.shape[1]))
            for laws, colour, at in self._by_colour(rows):
                place, tooth = (rows[name].to_numpy()[at] for name in ("place", "tooth"))
                drawn = laws.draw(stream, place, tooth, **_law(rows.iloc[at]))
                x[at] = drawn if colour is None else coloured(drawn, colour)
            yield rows, x

    @cached_property
    def log_prior(self) -> FloatArray:
        """(templates, teeth) logarithm of the share of each among the rows."""
        place, tooth = (self.rows[name].to_numpy() for name in ("place", "tooth"))
        return log_prior(place, tooth, self.hypotheses.healthy, self.hypotheses.teeth)

    @cached_property
    def continuous_severity(self) -> ContinuousSeverity | None:
        """Posteriors over severities between the templates; None where these show too little of what lies there."""
        if self.hypotheses.untied or self.hypotheses.nuisances is not None:
            return None
        laws, severity = self.hypotheses, self.severity
        noise = float(self.rows["noise"].min())
        between = severity_interpolation(laws.teeth, [severity], [laws.healthy], [laws.signal], noise=noise)
        if between is None or not between.holds:
            return None
        share = np.exp(self.log_prior).sum(axis=1)
        return ContinuousSeverity(severity_grids(severity, laws.healthy), laws.healthy, share)

    @cached_property
    def kinds(self) -> list[str]:
        """(templates,) kind of the damage of each template, see :func:`sigdb.database.damage_kinds`."""
        return damage_kinds(self.hypotheses.cases)

    @cached_property
    def prior(self) -> Posterior:
        """The probabilities before an average is seen."""
        return posterior(np.zeros((1, *self.log_prior.shape)), self.log_prior, self.hypotheses.healthy)


def operating_points(
    database: Database,
    ids: ArrayLike | None = None,
    *,
    among: ArrayLike | None = None,
    sensor: str | None = None,
    damaged: bool = False,
    like: Sequence[OperatingPoint] = (),
) -> tuple[list[OperatingPoint], dict[str, int]]:
    """Return the operating points of some rows, and the number of rows outside the law by reason.

    The prior is the share of each template and tooth among all rows of the operating point that are inside the law,
    requested or not, or among some of them. Noise and index errors are taken to be the same for all cases. Where they
    are not, they carry information on the case that this prior does not use.

    Parameters
    ----------
    database
        A database with rows.
    ids
        Requested rows; all if left out.
    among
        Rows whose shares are the prior; all if left out. They contain the requested ones.
    sensor
        A stored sensor; the first one if left out.
    damaged
        Whether only rows with one severity count: damaged ones without a pattern.
    like
        Operating points whose hypotheses are taken, so that templates are not read again.

    Returns
    -------
    points
        Operating points with those of these rows that are inside the law.
    outside
        Number of requested rows that are not, by reason.

    Raises
    ------
    NotApplicableError
        If no row is inside the law.
    """
    rows = _rows(database, sensor)
    rows = rows if among is None else rows[np.isin(rows.index, among)]
    wanted = np.isin(rows.index, ids) if ids is not None else np.full(len(rows), True)
    reasons = {"without a result": ~rows["done"], "with loss of contact": rows["contact_loss"].eq(True)}
    if damaged:
        wanted &= (rows["tooth"] > 0).to_numpy()
        reasons |= {"with a pattern of damage": rows["patterned"], "healthy": rows["tooth"] == 0}
    counts = {reason: int((some & wanted).sum()) for reason, some in reasons.items()}
    outside = {reason: count for reason, count in counts.items() if count}
    inside = rows.assign(requested=wanted)[~np.any(list(reasons.values()), axis=0)]
    laws = {point.place: point.hypotheses for point in like}
    quantities = database_quantities(database)
    points = [
        replace(_point(database, some, sensor, laws), quantities=quantities)
        for _, some in inside.groupby(_POINT)
        if some["requested"].any()
    ]
    if not points:
        raise NotApplicableError(f"{database.store}: no row follows the law of the bound ({outside})")
    return points, outside


def _law(rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Return the arguments of the law of rows."""
    return {name: rows[name].to_numpy() for name in ("noise", "index_error")}


def _rows(database: Database, sensor: str | None = None) -> pd.DataFrame:
    columns = ", ".join(dict.fromkeys((*_COLUMNS, *_POINT, *QUANTITIES, *damage_columns(database))))
    answers = "status = 'ok' as done, pattern <> '' as patterned"
    colour = suffixed("noise_colour", database.sensors, database.stored_sensor(sensor))
    if colour in database.dataset("features").schema.names:
        answers += f', coalesce("{colour}", 0) as colour'
    return database.sql(f"select {columns}, {answers} from cases order by id").set_index("id")


def _point(
    database: Database, rows: pd.DataFrame, sensor: str | None, laws: Mapping[Place, Hypotheses]
) -> OperatingPoint:
    speed_rpm, torque, teeth = place = _place(rows)
    hypotheses = laws.get(place) or Hypotheses.of(
        database, speed_rpm=speed_rpm, torque=torque, teeth=teeth, sensor=sensor, untied=True
    )
    template = pd.Index(hypotheses.cases["template"]).get_indexer(pd.Index(rows["template"]))
    deviation = noise_deviation(hypotheses.reference_variance[template], rows["snr_db"].to_numpy())
    rows = rows.assign(place=template, noise=deviation / np.sqrt(rows["averages"].to_numpy()))
    return OperatingPoint(hypotheses=hypotheses, rows=rows, colours=_colours(database, hypotheses))


def _colours(database: Database, laws: Hypotheses) -> FloatArray | None:
    """Return the colours of noise of a database's rows; None where all noise is white."""
    stated = database.manifest.resolved.get("nuisance", {})
    settings = validated(NuisanceSettings, stated, owner=str(database.store))
    if not settings.colour_db:
        return None
    return drawn_colours(settings, database.manifest.seed, laws.signal.shape[1], laws.teeth)


def _place(rows: pd.DataFrame) -> Place:
    speed_rpm, torque, teeth = (rows[name].iloc[0].item() for name in _POINT)
    return speed_rpm, torque, teeth
