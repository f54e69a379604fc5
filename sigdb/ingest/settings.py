"""Settings of an ingest: what is averaged of each recording, and how it is read."""

from typing import Annotated, Any

from pydantic import Field, Strict

from sigdb.core import Section, quantity
from sigdb.recording import DOUBTS, AveragingSettings, RecordingSettings

Names = Annotated[tuple[str, ...], Strict(False)]


class IngestSettings(Section):
    """Settings that hold for all recordings of an ingest; the table of recordings wins over them."""

    rig: str | None = Field(default=None, description="Built-in rig or TOML file.")
    teeth: str | None = Field(
        default=None, description="Instead of a rig: tooth count of the averaged gear and of its mate, 32/80, or 32."
    )
    gears: Names = Field(default=(), description="Averaged gears of the rig; the driving gear if left out.")
    channels: Names = Field(default=(), description="Averaged channels; all signals if left out.")
    averages: int | None = quantity(
        "rev", "Revolutions of each average; one average of all revolutions if left out.", ge=1, default=None
    )
    samples_per_tooth: int = quantity("-", "Samples of an average in a tooth pass.", ge=8, default=64)
    averages_of: str | None = Field(
        default=None,
        description="Name of the array of averages in files of another program (NPZ, MAT, HDF5, Parquet), whose rows "
        "are simulated elsewhere; None for recordings.",
    )
    accept: Names = Field(
        default=(),
        description="Codes of doubts of the reading that are accepted: rows of such recordings have a result.",
    )
    reading: RecordingSettings = Field(default=RecordingSettings(), description="How files are read.")
    averaging: AveragingSettings = Field(default=AveragingSettings(), description="How angles are found.")

    def resolved(self) -> dict[str, Any]:
        """Return all that is set, as TOML and JSON hold it."""
        return self.model_dump(mode="json", exclude_none=True, exclude={"reading", "averaging"}) | {
            name: getattr(self, name).model_dump(mode="json", exclude_unset=True, exclude_none=True)
            for name in ("reading", "averaging")
        }

    @property
    def doubts(self) -> frozenset[str]:
        """Codes of notes for which a row has no result."""
        return DOUBTS - set(self.accept)
