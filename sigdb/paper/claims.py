"""The claims of the paper: their words, and the rules by which they hold."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from sigdb.paper import claim_results
from sigdb.paper.claim_results import ClaimResult
from sigdb.paper.signals import PaperSignals


@dataclass(frozen=True, kw_only=True)
class ClaimText:
    """The words of a claim.

    Attributes
    ----------
    id, figure
        Its id, and the paper's figure.
    kind
        ``check`` where the rig is expected to show it, ``report`` where only its result is reported.
    shows
        Observation in the paper.
    leading
        Name of the leading number.
    rule
        Rule by which the claim holds.
    """

    id: str
    figure: str
    kind: Literal["check", "report"]
    shows: str
    leading: str
    rule: str


@dataclass(frozen=True, kw_only=True)
class Claim(ClaimText):
    """A claim that signals can decide.

    Attributes
    ----------
    find
        Function from signals to its result.
    """

    find: Callable[[PaperSignals], ClaimResult]


CLAIMS = (
    Claim(
        id="P1",
        figure="5",
        kind="check",
        shows="A phase shift of 1.5, 3, 4.5 deg at tooth 6 lets amplitude and phase rise at the 6th tooth pass, more "
        "with more shift.",
        leading="rise of the amplitude at 4.5 deg",
        rule="The greatest departures of amplitude and phase modulation from their medians in pass 6 are upwards, grow "
        "with the shift, and reach 0.05 and 5 deg of mesh phase at 4.5 deg.",
        find=claim_results.modulation_rises,
    ),
    Claim(
        id="P2",
        figure="5",
        kind="check",
        shows="Sidebands grow with the shift, and the spectrum alone cannot tell when.",
        leading="sum of sidebands / mesh line at 4.5 deg",
        rule="The sum of the five pairs of sidebands grows from 0 to 4.5 deg. The amplitude spectra with the damage at "
        "tooth 6 and at tooth 9 differ by less than 1e-3 of the highest line.",
        find=claim_results.sidebands_grow,
    ),
    Claim(
        id="P3",
        figure="5",
        kind="check",
        shows="The distribution has the mesh order all around, and components at orders 8 and 4 in passes 6 and 7.",
        leading="lesser of orders 8 and 4 in passes 6 and 7 / ridge",
        rule="At 4.5 deg the ridge stays above 0.1 of its median, and at both orders the mean over passes 6 and 7 is "
        "at least 0.02 of the ridge and twice the mean magnitude elsewhere.",
        find=claim_results.mesh_order_and_low_orders,
    ),
    Claim(
        id="P3, order 1",
        figure="5",
        kind="report",
        shows="There is a component at order 1, too, in passes 6 and 7.",
        leading="order 1 in passes 6 and 7 / ridge",
        rule="As orders 8 and 4.",
        find=claim_results.order_one,
    ),
    Claim(
        id="P4",
        figure="6",
        kind="check",
        shows="A loss of 25 or 50 % at tooth 6 makes a marked change at the 6th tooth pass.",
        leading="change in pass 6 at 50 %",
        rule="The change's rms in pass 6 is at least 0.2 of the healthy rms at 25 %, more at 50 %, and twice that in "
        "pass 5.",
        find=claim_results.marked_change,
    ),
    Claim(
        id="P5",
        figure="6",
        kind="check",
        shows="At 50 % the 7th tooth pass has a much larger amplitude.",
        leading="amplitude of pass 7 / healthy",
        rule="Pass 7 is the largest of all, and at least 1.5 times the healthy one.",
        find=claim_results.pass_seven_largest,
    ),
    Claim(
        id="P5, the rest",
        figure="6",
        kind="report",
        shows="At 50 % the amplitude about 180 deg almost vanishes, and the 8th and 9th pass are reduced.",
        leading="least amplitude within 15 deg of 180 deg / healthy",
        rule="A stretch of a pass centred within 15 deg of 180 deg has at most 0.25 of the healthy amplitude, and "
        "passes 8 and 9 have less than the healthy one.",
        find=claim_results.vanishing_and_reduced,
    ),
    Claim(
        id="P6",
        figure="6",
        kind="check",
        shows="At 50 % components below the mesh order are much higher; the distribution has a cross at the mesh order "
        "and the 6th tooth pass, and the mesh order all around.",
        leading="arms of the cross in pass 6 / median",
        rule="The orders below the mesh have 0.1 of its line and 1.5 times as much as at 25 %. The distribution next "
        "to the ridge in pass 6 is at least 0.02 of the ridge and twice its median. The ridge stays above 0.1.",
        find=claim_results.cross_of_the_loss,
    ),
    Claim(
        id="P7",
        figure="8A, 9A",
        kind="report",
        shows="A single heavily pitted tooth with friction gives a spectrum and a distribution like those measured at "
        "12 h.",
        leading="sum of sidebands / mesh line",
        rule="The measured signal is not at hand: nothing to compare with.",
        find=claim_results.single_pitted_tooth,
    ),
    Claim(
        id="P8",
        figure="8B, 9B",
        kind="report",
        shows="A broken tooth between two pitted ones gives a large cross at the 6th tooth pass, as measured at "
        "17.8 h.",
        leading="arms of the cross in pass 6 / median",
        rule="As the cross of P6, and its arms are twice those of the single pitted tooth.",
        find=claim_results.large_cross,
    ),
    Claim(
        id="P9",
        figure="7B",
        kind="report",
        shows="The measured signal has order 14 and a small modulation in passes 4 and 5, which the model has not.",
        leading="order 14 / greater neighbour",
        rule="In the case of Figure 8B order 14 does not rise above both its neighbours, and the change in passes 4 "
        "and 5 is below 0.2 of the healthy rms.",
        find=claim_results.no_order_fourteen,
    ),
)
"""The claims that signals can decide. P10, on effort and accuracy, is in :mod:`sigdb.paper.truncation`."""
