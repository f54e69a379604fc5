"""Notes: facts for people that the program may look at too."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType


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
