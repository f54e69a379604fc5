"""One posterior of each machine of a database, from all its averages: the answers, and the best that there can be."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, InputError, IntArray, NotApplicableError, blocks
from sigdb.database import QUANTITIES, Database, damage_kinds
from sigdb.recognition.bound.operating_points import OperatingPoint, operating_points
from sigdb.recognition.fusion.joint_law import AverageLaw, DamageKey, JointLaw
from sigdb.recognition.fusion.kind_posterior import kind_posterior, size_posterior, stored_sizes
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.templates.posterior import log_prior, posterior

FUSED = ("sensors", "points", "recordings")
"""Sources of averages that are fused: sensors of a recording, operating points, recordings at one of them."""

_ROWS_AT_ONCE = 1024
"""Rows whose averages are in memory at once."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fusion:
    """The answers of the Bayes rule to machines, each with all its averages.

    A machine is a pair of gears with its damage. No rule that sees the same averages is better on average.

    Attributes
    ----------
    machines
        By number: ``specimen``, ``teeth``, ``tooth`` and the severities, as the database has them; ``rows`` and
        ``averages``, their numbers. Then the answer: ``predicted`` (the most probable tooth, 0 for none),
        ``probability`` of it, ``log_odds`` (logarithm of P(damage) / P(none)), ``entropy`` (of the tooth, nats), and
        the median of each severity given damage, ``median_QUANTITY``. ``kind`` of the damage (:func:`damage_kinds`),
        ``predicted_kind`` and its ``kind_probability``. Sizes that the database stores besides the severities, such as
        ``crack_depth`` (m), each with the median and a 90 % interval, given that the damage has that size:
        ``median_SIZE``, ``low_SIZE``, ``high_SIZE``. And the losses: ``error`` (0 or 1) and ``log_loss`` (nats) of the
        tooth, ``kind_error`` of the kind.
    rows
        Number of the machine of each row, by id.
    sensors
        Sensors whose averages are used.
    outside
        Number of rows outside the law, by reason; they are in no machine.
    """

    machines: pd.DataFrame
    rows: "pd.Series[int]" = field(repr=False)
    sensors: tuple[str, ...]
    outside: dict[str, int]

    @property
    def accuracy(self) -> Estimate:
        """Share of the machines whose answer is right, with a 95 % interval over specimens."""
        return Specimens(self.machines["specimen"].to_numpy()).mean(1 - self.machines["error"].to_numpy(float))


class SensorPoint(NamedTuple):
    """The law of averages of one sensor at an operating point, with its cases and the rows there."""

    law: AverageLaw
    cases: pd.DataFrame
    rows: pd.DataFrame

    @classmethod
    def of(cls, point: OperatingPoint) -> Self:
        """Return those of an operating point."""
        if point.colours is not None:
            raise NotApplicableError("averages with coloured noise are not fused; leave colour_db of [nuisance] out")
        return cls(AverageLaw.of(point.hypotheses), point.hypotheses.cases, point.rows)


def fuse(
    database: Database,
    ids: ArrayLike | None = None,
    *,
    sensors: Sequence[str] | None = None,
    over: Sequence[str] = FUSED,
) -> Fusion:
    """Return one posterior of each machine of a database, from all its averages.

    Averages have independent noise and common index errors (:class:`JointLaw`). The law is that of the database, so
    that the answers are the best possible ones. Rows are of one machine where specimen, damage and tooth are the same.

    Parameters
    ----------
    database
        A database with rows, of a rig with one mesh.
    ids
        Rows; all if left out.
    sensors
        Stored sensors; all if left out.
    over
        Sources that are fused, of ``sensors``, ``points`` (operating points) and ``recordings`` (rows at one operating
        point). Without ``sensors`` only the first one counts. Without ``points`` or ``recordings`` each operating point
        or recording makes an answer of its own.

    Returns
    -------
    Fusion
        The answers, and their losses.

    Raises
    ------
    InputError
        If a source or a sensor is not one that exists.
    NotApplicableError
        If no row is inside the law, or the rig does not turn exactly.

    Examples
    --------
    The gain of all sensors over the first::

        both, one = fuse(database, over=["sensors"]), fuse(database, over=[])
        both.accuracy.value - one.accuracy.value
    """
    for name in over:
        if name not in FUSED:
            raise InputError(f"over = {name!r} is no source of averages; choose of {', '.join(FUSED)}")
    names = [database.stored_sensor(each) for each in (sensors or database.sensors)]
    names = list(dict.fromkeys(names if "sensors" in over else names[:1]))
    of_sensors: list[list[SensorPoint]] = []
    outside: dict[str, int] = {}
    for name in names:
        points, outside = operating_points(database, ids, sensor=name)
        of_sensors.append([SensorPoint.of(point) for point in points])
    keys = dict.fromkeys(key for points in of_sensors for point in points for key in point.law.keys)
    numbers = {key: number for number, key in enumerate(keys)}
    damages = _damages(of_sensors[0], numbers)
    every = _machines(of_sensors[0], numbers, over)
    requested = every[every["requested"]]
    layouts = requested.groupby("machine")["point"].agg(tuple)
    answers = [
        _answers(
            database, names, of_sensors, numbers, damages,
            table=requested[requested["machine"].isin(some.index)],
            peers=every[every["point"].isin(layout)].groupby("machine").first(),
            layout=layout,
        )
        for layout, some in layouts.groupby(layouts)
    ]  # fmt: skip
    machines = pd.concat(answers).sort_index()
    return Fusion(machines=machines, rows=requested["machine"], sensors=tuple(names), outside=outside)


def _damages(points: Sequence[SensorPoint], numbers: Mapping[DamageKey, int]) -> pd.DataFrame:
    """Return ``kind`` and sizes of the damage of each number."""
    cases = pd.concat([point.cases for point in points])
    of_cases = [numbers[key] for point in points for key in point.law.keys]
    damages = cases.assign(number=of_cases, kind=damage_kinds(cases)).drop_duplicates("number").set_index("number")
    return damages.sort_index()[["kind", *stored_sizes(cases)]]


def _machines(points: Sequence[SensorPoint], numbers: Mapping[DamageKey, int], over: Sequence[str]) -> pd.DataFrame:
    """Return all rows by id, in the order of their machines, with ``point``, ``machine`` and ``damage``, a number."""
    parts = []
    for number, point in enumerate(points):
        damage = np.array([numbers[key] for key in point.law.keys], int)
        parts.append(point.rows.assign(point=number, damage=damage[point.rows["place"].to_numpy()]))
    table = pd.concat(parts)
    alike = ["teeth", "specimen", "damage", "tooth"]
    table["recording"] = table.groupby([*alike, "point"]).cumcount()
    alike += ["point"] if "points" not in over else []
    alike += ["recording"] if "recordings" not in over else []
    table["machine"] = table.groupby(alike).ngroup()
    return table.sort_values(["machine", "point", "recording"])


def _answers(
    database: Database,
    sensors: Sequence[str],
    of_sensors: Sequence[Sequence[SensorPoint]],
    numbers: Mapping[DamageKey, int],
    damages: pd.DataFrame,
    *,
    table: pd.DataFrame,
    peers: pd.DataFrame,
    layout: Sequence[int],
) -> pd.DataFrame:
    """Return the answers to machines whose rows lie alike at operating points.

    All machines at these points are the prior, since the number of recordings says nothing of the damage.
    """
    joint = JointLaw.of([points[number].law for points in of_sensors for number in layout])
    place, of_templates = np.full(len(numbers), -1), [numbers[key] for key in joint.keys]
    place[of_templates] = np.arange(len(joint.keys))
    kinds, geometry = damages["kind"].loc[of_templates], damages.loc[of_templates].drop(columns="kind")
    prior = log_prior(_common(place[peers["damage"]]), peers["tooth"].to_numpy(), joint.healthy, joint.teeth)
    first = table.groupby("machine").first()
    noise = [pd.concat([point.rows["noise"] for point in points]) for points in of_sensors]
    ids = table.index.to_numpy().reshape(-1, len(layout))
    levels, parts = np.nan_to_num(joint.severity.T), []
    for some in blocks(len(ids), max(1, _ROWS_AT_ONCE // len(layout))):
        averages = list(_averages(database, sensors, ids[some]))
        sizes = np.tile(table["index_error"].loc[ids[some].ravel()].to_numpy().reshape(-1, len(layout)), len(sensors))
        of_rows = np.hstack([each.loc[ids[some].ravel()].to_numpy().reshape(-1, len(layout)) for each in noise])
        after = posterior(joint.log_likelihood(averages, noise=of_rows, index_error=sizes), prior, joint.healthy)
        truth = first.iloc[some]
        severities = {f"median_{name}": after.median(level) for name, level in zip(QUANTITIES, levels, strict=True)}
        predicted, of_kinds = after.tooth, kind_posterior(after, kinds)
        true = damages.loc[truth["damage"]].set_axis(truth.index)
        kind = of_kinds.idxmax(axis=1).to_numpy()
        parts.append(
            truth[["specimen", "teeth", "tooth", *QUANTITIES]]
            .join(true)
            .assign(
                rows=len(layout),
                averages=len(joint.laws),
                predicted=predicted,
                probability=1 - after.risk,
                log_odds=after.log_odds,
                entropy=after.entropy,
                **severities,
                predicted_kind=kind,
                kind_probability=of_kinds.max(axis=1).to_numpy(),
                **size_posterior(after, geometry),
                error=(predicted != truth["tooth"]).astype(float),
                log_loss=-after.location[np.arange(len(truth)), truth["tooth"].to_numpy()],
                kind_error=(kind != true["kind"]).astype(float),
            )
        )
    return pd.concat(parts)


def _common(places: IntArray) -> IntArray:
    """Return the places of templates, all of which are common to the averages."""
    if (places < 0).any():
        raise InputError(
            "some damage of the rows has templates at a part of their operating points only; fuse rows at those points "
            "alone, by ids"
        )
    return places


def _averages(database: Database, sensors: Sequence[str], ids: IntArray) -> Iterator[FloatArray]:
    """Yield the averages (machines, n) of each sensor and column of ids (machines, rows)."""
    order, inverse = np.unique(ids.ravel(), return_inverse=True)
    for sensor in sensors:
        x = database.signals(order, sensor=sensor)["tsa"][inverse.ravel()]
        yield from x.reshape(*ids.shape, -1).transpose(1, 0, 2)
