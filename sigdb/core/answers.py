"""Answers and notes: sentences for people, with kinds, codes and values for the program."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, Self

Kind = Literal[
    "no change",
    "level changed",
    "one tooth",
    "several teeth",
    "damage",
    "gear changed",
    "one event",
    "nothing stands out",
    "cannot be judged",
]
"""Kinds of answer to the question whether a gear is damaged."""


@dataclass(frozen=True, kw_only=True)
class AnswerForm:
    """Sentence, exit code and meaning of a kind of answer.

    Attributes
    ----------
    sentence
        The sentence, with the names of its values in braces.
    exit_code
        Exit code of a command with this answer: 0 without damage, 1 with damage, 3 without an answer. Bad input has 2.
    meaning
        Meaning of the answer.
    """

    sentence: str
    exit_code: int
    meaning: str


ANSWERS: Mapping[Kind, AnswerForm] = MappingProxyType(
    {
        "no change": AnswerForm(
            sentence="No change; {power}.",
            exit_code=0,
            meaning="no tooth stands out, and damage of the stated size would have been seen",
        ),
        "level changed": AnswerForm(
            sentence="The level or the sensor has changed, no tooth stands out; the likelier cause is {cause}. At this "
            "level {power}.",
            exit_code=0,
            meaning="no tooth stands out; levels have changed for all teeth alike, and the sentence names the likelier "
            "cause: speed, load, gain or polarity of the sensor, mounting",
        ),
        "one tooth": AnswerForm(
            sentence="One tooth stands out: {teeth}{counted}.",
            exit_code=1,
            meaning="a tooth stands out: its number, with an interval or with the other teeth that it may be",
        ),
        "several teeth": AnswerForm(
            sentence="Several teeth stand out: {teeth}{counted}.",
            exit_code=1,
            meaning="teeth more than 2.5 tooth passes apart stand out",
        ),
        "damage": AnswerForm(
            sentence="The gear is damaged at a tooth that is not known{named}.",
            exit_code=1,
            meaning="a detector finds damage, or a model of kinds, which names those that it may be; neither locates",
        ),
        "gear changed": AnswerForm(
            sentence="The gear has changed at no single tooth: {reason}.",
            exit_code=1,
            meaning="by a monitor: the vibration between the mesh harmonics has changed for all teeth alike, more than "
            "load, speed or sensor explain: wear, another gear, or another path",
        ),
        "one event": AnswerForm(
            sentence="One event at one place of this gear's turn, in {same_place} of {revolutions} revolutions: a "
            "damaged tooth, or another part that turns with this shaft.",
            exit_code=1,
            meaning="without a healthy recording: an event stands at one place of the turn in nearly every revolution, "
            "larger than pitch errors of ordinary gears give: a damaged tooth, or another part that turns with this "
            "shaft",
        ),
        "nothing stands out": AnswerForm(
            sentence="Nothing stands out of what healthy gears show{power}.",
            exit_code=0,
            meaning="without a healthy recording, or by a model: nothing stands out of what healthy gears show; a "
            "diagnosis states what would have been seen",
        ),
        "cannot be judged": AnswerForm(
            sentence="Cannot be judged: {reason}.",
            exit_code=3,
            meaning="the gear is not to be seen in one of the recordings, there are too few revolutions or no common "
            "band, or no damage of the range would have been seen; a row lies outside the range of a model, or damage "
            "and none are both likely",
        ),
    }
)
"""The answers of diagnoses, models and monitors, by kind."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """An answer: its kind, and the sentence.

    Attributes
    ----------
    kind
        Kind, a key of :data:`ANSWERS`.
    sentence
        The sentence that people read.

    Examples
    --------
    >>> answer = Answer.of("one tooth", teeth="9 ± 1")
    >>> str(answer), answer.exit_code
    ('One tooth stands out: 9 ± 1.', 1)
    """

    kind: Kind
    sentence: str

    @classmethod
    def of(cls, kind: Kind, **values: str | int) -> Self:
        """Return the answer of a kind with its values; ``counted``, ``power`` and ``named`` may be left out."""
        clauses = {"counted": "", "power": "", "named": ""}
        return cls(kind=kind, sentence=ANSWERS[kind].sentence.format_map(clauses | values))

    @classmethod
    def of_teeth(cls, candidates: Sequence[int]) -> Self:
        """Return the answer of a set of teeth that the damaged one may be, with 0 for no damage.

        Parameters
        ----------
        candidates
            Answers that cannot be ruled out, in rising order.

        Examples
        --------
        >>> for candidates in ((0,), (6,), (6, 7, 9), (0, 6)):
        ...     print(Answer.of_teeth(candidates))
        Nothing stands out of what healthy gears show.
        One tooth stands out: 6.
        One tooth stands out: 6, 7 or 9.
        Cannot be judged: no damage and damage at tooth 6 are both likely.
        """
        teeth = _alternatives([tooth for tooth in candidates if tooth])
        if not candidates:
            return cls.of("cannot be judged", reason="neither a tooth nor the absence of damage is likely")
        if not teeth:
            return cls.of("nothing stands out")
        if 0 in candidates:
            return cls.of("cannot be judged", reason=f"no damage and damage at tooth {teeth} are both likely")
        return cls.of("one tooth", teeth=teeth)

    @classmethod
    def of_kinds(cls, candidates: Sequence[str]) -> Self:
        """Return the answer of a set of kinds that the damage may be of, with ``none`` for no damage.

        Parameters
        ----------
        candidates
            Kinds that cannot be ruled out.

        Examples
        --------
        >>> for candidates in (("none",), ("crack", "pit"), ("none", "pit")):
        ...     print(Answer.of_kinds(candidates))
        Nothing stands out of what healthy gears show.
        The gear is damaged at a tooth that is not known; the kind is crack or pit.
        Cannot be judged: no damage and damage of the kind pit are both likely.
        """
        kinds = _alternatives([kind for kind in candidates if kind != "none"])
        if not candidates:
            return cls.of("cannot be judged", reason="neither a kind of damage nor its absence is likely")
        if not kinds:
            return cls.of("nothing stands out")
        if "none" in candidates:
            return cls.of("cannot be judged", reason=f"no damage and damage of the kind {kinds} are both likely")
        return cls.of("damage", named=f"; the kind is {kinds}")

    @property
    def exit_code(self) -> int:
        """Exit code of a command with this answer."""
        return ANSWERS[self.kind].exit_code

    def __str__(self) -> str:
        return self.sentence


def _alternatives(some: Sequence[int | str]) -> str:
    *first, last = (str(each) for each in some) if some else ("",)
    return f"{', '.join(first)} or {last}" if first else last


@dataclass(frozen=True, kw_only=True)
class Note:
    """A sentence for people, with a code and values for the program.

    The program looks at ``code`` and ``values`` only, so that a better sentence breaks nothing.

    Attributes
    ----------
    code
        Subject of the note, in words joined by hyphens; it never changes.
    text
        The sentence that people read.
    values
        Numbers and names in the sentence.

    Examples
    --------
    >>> note = Note(code="few-revolutions", text="the average has 3 revolutions", values={"revolutions": 3})
    >>> str(note)
    'the average has 3 revolutions'
    """

    code: str
    text: str
    values: Mapping[str, float | int | str] = field(default_factory=lambda: MappingProxyType({}))

    def __str__(self) -> str:
        return self.text
