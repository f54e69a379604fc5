"""The table of the paper's claims on a rig, and how it moves with the rig's numbers."""

from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

from threadpoolctl import threadpool_limits

from sigdb.core import SigdbError
from sigdb.paper import sensitivity as truncation
from sigdb.paper.claims import CLAIMS, ClaimResult
from sigdb.paper.sensitivity import variations
from sigdb.paper.signals import PaperSignals, check_subject, paper_signals
from sigdb.transmission import Transmission

_EFFORT = {
    "id": "P10",
    "figure": "5 to 9",
    "kind": "report",
    "shows": truncation.SHOWS,
    "leading": truncation.LEADING,
    "rule": truncation.RULE,
}


def paper_claims(
    rig: Transmission,
    *,
    gear: str = "pinion",
    sensor: str = "pinion-vertical",
    sensitivity: bool = True,
    on_step: Callable[[str], Any] = lambda step: None,
) -> dict[str, Any]:
    """What the paper shows, P1 to P10, as numbers on clean signals of a rig.

    The paper is Choy, Polyshchuk, Zakrajsek, Handschuh, Townsend, "Analysis of the Effects of Surface Pitting and Wear
    on the Vibrations of a Gear Transmission System", Tribology International 29(1), 1996,
    doi:10.1016/0301-679X(95)00037-2.

    Parameters
    ----------
    rig
        A rig with a pinion of 12 teeth.
    gear, sensor
        The damaged gear, and the sensor.
    sensitivity
        Whether to repeat it with one number of the rig changed at a time.
    on_step
        Called with what is about to be computed.

    Returns
    -------
    dict
        ``rig``, ``gear``, ``sensor``; ``min_compression`` of the mesh in all cases, as a fraction of the static one;
        ``claims``, a list of dictionaries with ``id``, ``figure``, ``kind`` (``check`` or ``report``), ``shows``,
        ``leading`` and ``rule`` in words, ``value`` (the leading number), ``holds`` (None: nothing to judge by) and
        ``numbers``; ``sensitivity``, a list of dictionaries with ``what``, ``factor``, ``status``, ``min_compression``
        and ``claims``, value and holds by id.

    Raises
    ------
    InputError
        If the gear has not 12 teeth, or the rig has no such sensor.
    UnstableRigError
        If the rig is unstable.

    Examples
    --------
    >>> import sigdb
    >>> facts = paper_claims(sigdb.load_transmission("nasa-spiral-bevel"), sensitivity=False)
    >>> [claim["id"] for claim in facts["claims"] if claim["kind"] == "check"]
    ['P1', 'P2', 'P3', 'P4', 'P5', 'P6']
    """
    check_subject(rig, gear, sensor)
    # The matrices are small, and times on one thread can be compared.
    with threadpool_limits(1):
        on_step("the paper's cases")
        signals = paper_signals(rig, gear=gear, sensor=sensor)
        claims = [_told(asdict(claim), claim.find(signals)) for claim in CLAIMS]
        effort = truncation.truncated_against_full(rig, gear=gear, sensor=sensor)
        rows = []
        for one in variations(rig, gear) if sensitivity else ():
            on_step(f"{one.what} times {one.factor:g}")
            rows.append({"what": one.what, "factor": one.factor} | _varied(one.rig, gear, sensor))
    return {
        "rig": rig.name,
        "gear": gear,
        "sensor": sensor,
        "min_compression": signals.min_compression,
        "claims": [*claims, _told(_EFFORT, effort)],
        "sensitivity": rows,
    }


def _told(claim: dict[str, Any], finding: ClaimResult) -> dict[str, Any]:
    return {name: value for name, value in claim.items() if name != "find"} | asdict(finding)


def _varied(rig: Transmission, gear: str, sensor: str) -> dict[str, Any]:
    """Status, least compression, and the claims' leading numbers on a changed rig."""
    try:
        signals = paper_signals(rig, gear=gear, sensor=sensor)
    except SigdbError as error:
        return {"status": str(error), "min_compression": None, "claims": {}}
    found = _findings(signals)
    # One short run tells the error, not the time.
    effort = truncation.truncated_against_full(rig, gear=gear, sensor=sensor, repeats=1)
    found["P10"] = replace(effort, holds=None)
    return {
        "status": "ok",
        "min_compression": signals.min_compression,
        "claims": {name: {"value": one.value, "holds": one.holds} for name, one in found.items()},
    }


def _findings(signals: PaperSignals) -> dict[str, ClaimResult]:
    return {claim.id: claim.find(signals) for claim in CLAIMS}
