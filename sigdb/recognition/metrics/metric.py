"""Metrics as data: how a metric follows from values of rows, and whether the Bayes rule bounds it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum

from sigdb.core import FloatArray
from sigdb.recognition.metrics.estimate import Estimate, Specimens


class Kind(Enum):
    """How a metric follows from the rows."""

    MEAN = "mean"
    """Mean of the values of rows that are not NaN."""
    ROOT_MEAN_SQUARE = "root mean square"
    """Root mean square of such values."""
    QUOTIENT = "quotient"
    """Quotient of sums, or a fit to them; single rows have no value."""


@dataclass(frozen=True, kw_only=True)
class Metric:
    """A metric of answers.

    Attributes
    ----------
    name
        Key in results and JSON.
    title
        Heading for readers.
    kind
        How it follows from the rows.
    better
        1 where greater is better, -1 where less is better, 0 where neither is.
    bounded
        Whether no rule exceeds the Bayes rule in it. Other metrics can be improved at the cost of another: a rule that
        answers 'none' to everything raises no false alarm.
    share
        Whether it is a share of the damaged rows, so that its standard error is at least that of independent rows.
    continuous
        Whether its values are of a quantity that is no count, so that those of 0 or 1 are no shares.
    factor
        Number by which it is multiplied for readers, in the unit of the title.
    """

    name: str
    title: str
    kind: Kind = Kind.MEAN
    better: int = 0
    bounded: bool = False
    share: bool = False
    continuous: bool = False
    factor: float = 1.0


def estimates(metrics: Iterable[Metric], values: Mapping[str, FloatArray], specimens: Specimens) -> dict[str, Estimate]:
    """Estimate the metrics that follow from values of rows.

    Parameters
    ----------
    metrics
        Metrics; those without values are left out.
    values
        Value of each row (rows,) by name of a metric, NaN where a row does not count.
    specimens
        Specimens of the rows.
    """
    valued = [metric for metric in metrics if metric.name in values]
    return {
        metric.name: specimens.root_mean_square(values[metric.name])
        if metric.kind is Kind.ROOT_MEAN_SQUARE
        else specimens.mean(values[metric.name], may_be_share=not metric.continuous)
        for metric in valued
    }


def differences(
    metrics: Iterable[Metric], values: Mapping[str, Mapping[str, FloatArray]], learner: str, specimens: Specimens
) -> dict[str, dict[str, Estimate]]:
    """Estimate the model minus each other estimator, in the metrics that both have row by row.

    Parameters
    ----------
    metrics
        Metrics.
    values
        Value of each row (rows,) by estimator and name of a metric.
    learner
        Name of the estimator that is the model.
    specimens
        Specimens of the rows.
    """
    metrics = list(metrics)
    ours = means(metrics, values[learner])
    theirs = {name: means(metrics, each) for name, each in values.items() if name != learner}
    return {
        name: {
            metric: specimens.mean(ours[metric] - each[metric], may_be_share=False) for metric in ours if metric in each
        }
        for name, each in theirs.items()
    }


def means(metrics: Iterable[Metric], values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the values whose plain means are metrics: those that can be compared row by row."""
    return {
        metric.name: values[metric.name] for metric in metrics if metric.kind is Kind.MEAN and metric.name in values
    }
