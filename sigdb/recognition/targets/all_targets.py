"""All targets by name."""

from collections.abc import Mapping

from sigdb.database import check_target
from sigdb.recognition.targets.detection import Detection
from sigdb.recognition.targets.kind import Kind
from sigdb.recognition.targets.location import Location
from sigdb.recognition.targets.severity import Severity
from sigdb.recognition.targets.target import Target

_ALL: tuple[Target, ...] = (Location(), Severity(), Detection(), Kind())

TARGETS: Mapping[str, Target] = {target.name: target for target in _ALL}
"""Targets by name."""

FACTORS = {metric.name: metric.factor for target in _ALL for metric in target.metrics}
"""Factors by which metrics are multiplied for readers, in the units of their titles."""

TITLES = {metric.name: metric.title for target in _ALL for metric in target.metrics}
"""Headings of metrics by name."""


def target_named(name: str) -> Target:
    """Return the target of a name.

    Raises
    ------
    InputError
        If there is no such target, or it cannot be learnt.
    """
    check_target(name, TARGETS)
    return TARGETS[name]
