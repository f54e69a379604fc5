"""Settings of a monitor: its rate of false alarms, its healthy recordings, the zones of the machine."""

from pydantic import Field

from sigdb.core import Section, quantity


class MonitorSettings(Section):
    """Settings of a monitor."""

    false_alarms_a_year: float = quantity(
        "-", "Number of false alarms a year that each gear and sensor may give.", gt=0, le=100, default=1.0
    )
    looks_a_year: float | None = quantity(
        "-", "Recordings a year; by default that of the dates.", gt=0, le=1e6, default=None
    )
    baseline: int | None = quantity(
        "-", "Number of first recordings that are healthy; by default those that are labelled so, or the first ten.",
        ge=5, le=1000, default=None,
    )  # fmt: skip
    severity_limit_db: float | None = quantity(
        "dB", "Difference of a tooth over that of the other teeth at which its life ends; none if left out.",
        gt=-6, le=40, default=None,
    )  # fmt: skip
    zones: tuple[float, float, float] | None = Field(
        default=None,
        description="Ends of the zones A, B and C that ISO 20816-9 gives for this machine, mm/s rms of the velocity.",
    )
