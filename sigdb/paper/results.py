"""The paper's claims on a rig, and their sensitivity to the rig's numbers."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from pydantic import TypeAdapter
from threadpoolctl import threadpool_limits

from sigdb.core import OnStep, SigdbError, ignore, plain
from sigdb.paper.claim_results import ClaimResult
from sigdb.paper.claims import CLAIMS, ClaimText
from sigdb.paper.signals import PaperSignals, check_subject, paper_signals
from sigdb.paper.truncation import TRUNCATION, truncated_against_full
from sigdb.paper.variations import Variation, variations
from sigdb.transmission import Transmission


@dataclass(frozen=True, kw_only=True)
class EvaluatedClaim(ClaimText, ClaimResult):
    """A claim with its result on a rig."""


@dataclass(frozen=True, kw_only=True)
class ClaimValue:
    """The leading number of a claim on a varied rig, and whether the claim holds."""

    value: float
    holds: bool | None


@dataclass(frozen=True, kw_only=True)
class VariedClaims:
    """The claims on a rig with one number changed.

    Attributes
    ----------
    what, factor
        The changed number, and the factor on it.
    status
        ``ok``, or the reason why the rig has no result.
    min_compression
        Least compression of the mesh in all cases, relative to the static one; None without a result.
    claims
        Leading numbers by id.
    """

    what: str
    factor: float
    status: str
    min_compression: float | None
    claims: Mapping[str, ClaimValue]


@dataclass(frozen=True, kw_only=True)
class PaperClaims:
    """The paper's claims on a rig.

    Attributes
    ----------
    rig, gear, sensor
        Names of the rig, the damaged gear and the sensor.
    min_compression
        Least compression of the mesh in all cases, relative to the static one.
    claims
        Claims P1 to P10: words, leading number ``value``, verdict ``holds`` and all ``numbers``.
    sensitivity
        The claims on varied rigs; empty if they were not requested.
    """

    rig: str
    gear: str
    sensor: str
    min_compression: float
    claims: tuple[EvaluatedClaim, ...]
    sensitivity: tuple[VariedClaims, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the claims as plain values for JSON.

        Returns
        -------
        dict
            Attributes by name; claims and variations are dictionaries in lists.
        """
        return {name: plain(value) for name, value in vars(self).items()}

    @classmethod
    def from_json(cls, facts: Mapping[str, Any]) -> "PaperClaims":
        """Return the claims from the values of :meth:`as_json`.

        Parameters
        ----------
        facts : dict
            Values that :meth:`as_json` returned.

        Returns
        -------
        PaperClaims
        """
        return TypeAdapter(cls).validate_python(facts)


def paper_claims(
    rig: Transmission,
    *,
    gear: str = "pinion",
    sensor: str = "pinion-vertical",
    sensitivity: bool = True,
    on_step: OnStep = ignore,
) -> PaperClaims:
    """Evaluate the paper's claims P1 to P10 on clean signals of a rig.

    The paper is Choy, Polyshchuk, Zakrajsek, Handschuh, Townsend, "Analysis of the Effects of Surface Pitting and Wear
    on the Vibrations of a Gear Transmission System", Tribology International 29(1), 1996,
    doi:10.1016/0301-679X(95)00037-2.

    Parameters
    ----------
    rig : Transmission
        A rig with a pinion of 12 teeth.
    gear, sensor : str
        The damaged gear, and the sensor.
    sensitivity : bool
        Whether to repeat the evaluation with one number of the rig changed at a time.
    on_step : callable
        Called with the name of each step before it begins.

    Returns
    -------
    PaperClaims
        The claims with their results, and their sensitivity to the rig's numbers.

    Raises
    ------
    InputError
        If the gear has not 12 teeth, or the rig has no such sensor.
    UnstableRigError
        If the rig is unstable.

    Examples
    --------
    >>> import sigdb
    >>> result = paper_claims(sigdb.load_transmission("nasa-spiral-bevel"), sensitivity=False)
    >>> [claim.id for claim in result.claims if claim.kind == "check"]
    ['P1', 'P2', 'P3', 'P4', 'P5', 'P6']
    """
    check_subject(rig, gear, sensor)
    # The matrices are small, and times on one thread can be compared.
    with threadpool_limits(1):
        on_step("the paper's cases")
        signals = paper_signals(rig, gear=gear, sensor=sensor)
        claims = [_evaluated(claim, claim.find(signals)) for claim in CLAIMS]
        claims.append(_evaluated(TRUNCATION, truncated_against_full(rig, gear=gear, sensor=sensor)))
        varied = []
        for variation in variations(rig, gear) if sensitivity else ():
            on_step(f"{variation.what} times {variation.factor:g}")
            varied.append(_vary(variation, gear, sensor))
    return PaperClaims(
        rig=rig.name,
        gear=gear,
        sensor=sensor,
        min_compression=signals.min_compression,
        claims=tuple(claims),
        sensitivity=tuple(varied),
    )


def _evaluated(claim: ClaimText, result: ClaimResult) -> EvaluatedClaim:
    words = {name: getattr(claim, name) for name in ClaimText.__dataclass_fields__}
    return EvaluatedClaim(**words, **asdict(result))


def _vary(variation: Variation, gear: str, sensor: str) -> VariedClaims:
    """Evaluate the claims on a varied rig; a rig that has no steady state gives a status without claims."""
    what, factor = variation.what, variation.factor
    try:
        signals = paper_signals(variation.rig, gear=gear, sensor=sensor)
    except SigdbError as error:
        return VariedClaims(what=what, factor=factor, status=str(error), min_compression=None, claims={})
    results = _results(signals)
    # A single short run gives the error, not the time.
    effort = truncated_against_full(variation.rig, gear=gear, sensor=sensor, repeats=1)
    results[TRUNCATION.id] = replace(effort, holds=None)
    return VariedClaims(
        what=what,
        factor=factor,
        status="ok",
        min_compression=signals.min_compression,
        claims={name: ClaimValue(value=result.value, holds=result.holds) for name, result in results.items()},
    )


def _results(signals: PaperSignals) -> dict[str, ClaimResult]:
    return {claim.id: claim.find(signals) for claim in CLAIMS}
