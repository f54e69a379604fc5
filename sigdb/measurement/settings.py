"""The section ``[measurement]`` of a recipe."""

from sigdb.core import Section, quantity


class MeasurementSettings(Section):
    """Settings of a measurement: averaged revolutions, noise and index errors."""

    averages: int = quantity(
        "rev", "Revolutions in the time-synchronous average, whole tooth cycles.", ge=1, default=102
    )
    snr_db: float = quantity(
        "dB",
        "10 log10(variance of the nominal healthy clean average / variance of one revolution's noise).",
        default=0.0,
    )
    index_error: float = quantity(
        "m",
        "Standard deviation of index errors along the mesh normal, one a tooth, before their mean is removed.",
        ge=0,
        default=2e-6,
    )
