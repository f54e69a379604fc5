"""A target that is a measurement: its numbers, each with its error."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

from pydantic import Field

from sigdb.core import Section
from sigdb.transmission import Transmission


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A measured number: its label with its unit, its value, and one standard deviation of its error."""

    label: str
    unit: str
    value: float
    error: float
    held_out: bool


def error_of(value: float, error: float | None, relative_error: float | None) -> float:
    """Return the standard deviation of a value, which is stated by itself or relative to the value."""
    return error if error is not None else (relative_error or 0.0) * abs(value)


def check_one_error(section: Section, what: str, error: str, relative: str = "relative_error") -> None:
    """Refuse a measurement whose error is not stated once."""
    stated = [name for name in (error, relative) if getattr(section, name, None) is not None]
    if len(stated) != 1:
        both = f"give {error} or {relative}"
        raise ValueError(f"{what} has {' and '.join(stated) or 'no error'}; {both}, one standard deviation")


class MeasuredTarget(Section, ABC):
    """A measurement, with its error."""

    held_out: bool = Field(default=False, description="Whether it is predicted instead of fitted.")

    @property
    @abstractmethod
    def quantities(self) -> list[Quantity]:
        """Its numbers, with their errors."""

    @abstractmethod
    def check(self, rig: Transmission) -> Iterator[str]:
        """Yield what does not fit a rig."""
