"""The rigs that show the paper's pictures, found by a search inside what is assumed of the built-in rig."""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from sigdb.core import FloatArray, SigdbError, validated
from sigdb.dynamics import PeriodicRig, prepare_periodic
from sigdb.paper.margins import HELD_OUT, TARGET_CASES, held_out_margins, target_margins, worst
from sigdb.paper.signals import PaperSignals, signals_of
from sigdb.paper.variations import with_bearings
from sigdb.transmission import Choice, Range, Transmission, built_in_file, load_transmission

PRIOR, GEAR, SENSOR, MESH = "nasa-spiral-bevel", "pinion", "pinion-vertical", "main"
"""The rig whose ranges are the prior, and what the paper looks at."""
ENSEMBLE = "nasa_spiral_bevel_identified.csv"
"""Values of the members' free numbers by dotted path: a line for each member. `output` is the sensor's quantity, and
`evaluations` those of the search when it found the member."""
NO_EFFECT = ("meshes.main.backlash",)
"""Numbers that linear signals do not depend on; all members have the prior's."""


def identified_rigs() -> tuple[Transmission, ...]:
    """Return the members of the identified ensemble; the first is the built-in ``nasa-spiral-bevel-identified``.

    Returns
    -------
    tuple of Transmission
        Rigs that hold the claims P1 to P6 for the shifts of 1.5 and 4.5 deg and the loss of 50 %. That the model can
        show the paper's pictures with these numbers is no evidence that the paper's rig had them.

    Examples
    --------
    >>> rigs = identified_rigs()
    >>> rigs[0].value("operating.speed_rpm")
    14400.0
    """
    prior = load_transmission(PRIOR)
    lines = built_in_file(ENSEMBLE).read_text(encoding="utf-8").splitlines()
    return tuple(member_of(prior, row, f"{PRIOR}-identified-{i}") for i, row in enumerate(csv.DictReader(lines), 1))


def evaluations() -> int:
    """Return after how many evaluations the search had found all members."""
    lines = built_in_file(ENSEMBLE).read_text(encoding="utf-8").splitlines()
    return max(int(row["evaluations"]) for row in csv.DictReader(lines))


def member_of(prior: Transmission, row: Mapping[str, str], name: str) -> Transmission:
    """Return the rig of a line of the ensemble."""
    choices = {number.path: number.assumption for number in prior.assumptions.free}
    values = {
        path: float(text) if isinstance(choices[path], Range) else _choice(text)
        for path, text in row.items()
        if path not in ("output", "evaluations") and text
    }
    return with_output(prior.with_assumed(values), row["output"], name)


def _choice(text: str) -> Choice:
    return int(text) if text.lstrip("-").isdigit() else text


def with_output(rig: Transmission, output: str, name: str | None = None) -> Transmission:
    """Return a rig whose sensor at the pinion has another quantity."""
    data = rig.model_dump() | {"name": name or rig.name}
    data["sensors"][SENSOR]["quantity"] = output
    return validated(Transmission, data, owner=f"rig {data['name']!r}")


def with_one_sensor(rig: Transmission, output: str) -> Transmission:
    """Return a rig whose only sensor is that at the pinion, with another quantity."""
    data = rig.model_dump()
    data["sensors"] = {SENSOR: {**data["sensors"][SENSOR], "quantity": output}}
    return validated(Transmission, data, owner=f"rig {rig.name!r}")


def distances(rigs: tuple[Transmission, ...]) -> FloatArray:
    """Return the (pairs,) rms differences of rigs, in parts of the ranges of the numbers that both have."""
    prior = load_transmission(PRIOR).assumptions
    numbers = prior.free
    points = [prior.to_unit(rig) for rig in rigs]
    ranged = np.array([isinstance(n.assumption, Range) and n.path not in NO_EFFECT for n in numbers])
    has = [ranged & [number.exists(rig.assumptions.chosen) for number in numbers] for rig in rigs]
    return np.asarray(
        [np.sqrt(np.mean((points[i] - points[j])[has[i] & has[j]] ** 2)) for i, j in combinations(range(len(rigs)), 2)]
    )


@dataclass(frozen=True, kw_only=True)
class RigMargins:
    """The margins of the claims on a rig.

    Attributes
    ----------
    margins
        The greatest margin of each claim, at most 0 where it holds, also of those that are held out.
    contact
        Least compression of the mesh in the targets' cases, relative to the static one; below 0 the teeth part, and
        the signals, of the linear rig, are wrong.
    min_compression
        The same in all cases.
    """

    margins: Mapping[str, float]
    contact: float
    min_compression: float

    @classmethod
    def of(cls, signals: PaperSignals, prepared: PeriodicRig) -> "RigMargins":
        """Return the margins of signals."""
        states = [prepared.steady_state([damage], specimens=False)[0] for damage in TARGET_CASES]
        return cls(
            margins=worst([*target_margins(signals), *held_out_margins(signals)]),
            contact=min(float(state.min_compression) for state in states),
            min_compression=signals.min_compression,
        )

    @property
    def worst_target(self) -> float:
        """The greatest margin of a target."""
        return max(margin for claim, margin in self.margins.items() if claim not in HELD_OUT)

    @property
    def holds_targets(self) -> bool:
        """Whether all targets hold, with the mesh in contact in their cases."""
        return self.contact > 0 and self.worst_target <= 0


def margins_of(rig: Transmission) -> RigMargins | None:
    """Return the margins of the claims on a rig; None where it is unstable or has no steady state."""
    try:
        prepared = prepare_periodic(rig, gear=GEAR)
        return RigMargins.of(signals_of(rig, prepared, SENSOR), prepared)
    except SigdbError:
        return None


def changed_rigs(rig: Transmission) -> Iterator[tuple[str, Transmission]]:
    """Yield the changes under which an identified rig should still hold its targets, each by its name."""
    flank = f"meshes.{MESH}.profile.flank"
    paths = {"speed": "operating.speed_rpm", "mesh stiffness": f"meshes.{MESH}.stiffness", "damping": "damping_ratio"}
    for sign in (-1, 1):
        yield f"bearings {15 * sign:+d} %", with_bearings(rig, 1 + 0.15 * sign)
        for name, path in (paths | {"flank": flank}).items():
            part = 3 if name == "speed" else 10
            yield f"{name} {part * sign:+d} %", rig.replace({path: (1 + 0.01 * part * sign) * rig.value(path)})
