"""The answers of a diagnosis: their names, sentences and exit codes."""

from collections.abc import Sequence
from typing import Literal

from sigdb.diagnosis.change.level import LevelChange
from sigdb.diagnosis.change.location import Location
from sigdb.diagnosis.change.power import SEEN, Power
from sigdb.recording import Repeatability

Kind = Literal[
    "no change",
    "level changed",
    "one tooth",
    "several teeth",
    "nothing stands out",
    "one event",
    "cannot be judged",
]
"""Kinds of answer: with healthy recordings, without them, and none."""

EXIT_CODES: dict[Kind, int] = {
    "no change": 0,
    "level changed": 0,
    "one tooth": 1,
    "several teeth": 1,
    "nothing stands out": 0,
    "one event": 1,
    "cannot be judged": 3,
}
"""Exit code of each answer: 0 without damage, 1 with damage, 3 without an answer. Bad input has 2."""

_CAUSES = {
    "speed": "the other speed",
    "load": "the other load",
    "sensor gain": "the gain of the sensor, since all levels changed alike",
    "polarity": "the polarity of the sensor, since all mesh harmonics are reversed",
    "load or mounting": "load, mounting or temperature",
}
"""Likelier causes of a change of levels, in words."""

_QUANTITIES = {
    "stiffness_loss": "a stiffness loss of {:.2g} or more",
    "pulse": "an event of {:.2g} of the average's rms or more",
}


def repeating_answer(repeatability: Repeatability | None) -> tuple[Kind, str]:
    """Return the kind and the sentence for a recording without a healthy one."""
    if repeatability is None:
        return "cannot be judged", "Cannot be judged: there is no healthy recording."
    sentence = f"{repeatability.reason[0].upper()}{repeatability.reason[1:]}."
    if repeatability.answer == "cannot be judged":
        return "cannot be judged", sentence
    return ("one event" if repeatability.answer == "event" else "nothing stands out"), sentence


def damage_answer(teeth: Sequence[Location], counted: str) -> tuple[Kind, str]:
    """Return the kind and the sentence for teeth that stand out."""
    named = ", ".join(_tooth(location) for location in teeth)
    if len(teeth) == 1:
        return "one tooth", f"One tooth stands out: {named}{counted}."
    return "several teeth", f"Several teeth stand out: {named}{counted}."


def _tooth(location: Location) -> str:
    return f"{location.tooth} ± {location.within}" if location.within else f"{location.tooth}"


def quiet_answer(level: LevelChange, power: Power, counted: str) -> tuple[Kind, str]:
    """Return the kind and the sentence where no tooth stands out."""
    seen = power_sentence(power, counted)
    if power.smallest is None:
        return "cannot be judged", f"Cannot be judged: {seen}."
    if level.changed:
        cause = _CAUSES[level.cause]
        return "level changed", (
            f"The level or the sensor has changed, no tooth stands out; the likelier cause is {cause}. At this level "
            f"{seen}."
        )
    return "no change", f"No change; {seen}."


def power_sentence(power: Power, counted: str = "") -> str:
    """Return what would have been seen, without a full stop."""
    quantity = _QUANTITIES[power.quantity]
    if power.smallest is None:
        greatest = quantity.format(power.greatest).removesuffix(" or more")
        return f"even {greatest} would have been seen with a probability below {SEEN:g}"
    share = "" if power.quantity == "pulse" else f" ({power.share_of_rms:.2g} of the average's rms)"
    sentence = f"{quantity.format(power.smallest)}{share} would have been seen at any tooth with probability {SEEN:g}"
    rows = power.exceptions.to_dict("records")
    parts = [f"at tooth {int(row['tooth'])} {_only_from(row['smallest'])}" for row in rows]
    return sentence + (f"; {', '.join(parts)}{counted}" if parts else "")


def _only_from(smallest: float) -> str:
    return f"only from {smallest:.2g}" if smallest == smallest else "not"
