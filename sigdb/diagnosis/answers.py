"""Answers of a diagnosis: the values of their sentences."""

from collections.abc import Sequence

from sigdb.core import Answer
from sigdb.diagnosis.change.level import LevelChange
from sigdb.diagnosis.change.location import Location
from sigdb.diagnosis.change.power import SEEN, Power

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


def cause_text(cause: str) -> str:
    """Return the likelier cause of a change of levels in words."""
    return _CAUSES[cause]


def damage_answer(teeth: Sequence[Location], counted: str) -> Answer:
    """Return the answer for teeth that stand out."""
    named = ", ".join(_tooth(location) for location in teeth)
    return Answer.of("one tooth" if len(teeth) == 1 else "several teeth", teeth=named, counted=counted)


def _tooth(location: Location) -> str:
    return f"{location.tooth} ± {location.within}" if location.within else f"{location.tooth}"


def quiet_answer(level: LevelChange, power: Power, counted: str) -> Answer:
    """Return the answer where no tooth stands out."""
    seen = power_sentence(power, counted)
    if power.smallest is None:
        return Answer.of("cannot be judged", reason=seen)
    if level.changed:
        return Answer.of("level changed", cause=_CAUSES[level.cause], power=seen)
    return Answer.of("no change", power=seen)


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
