"""Known numbers of a machine, as options and arguments state them."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import BeforeValidator, Strict, field_validator, model_validator

from sigdb.core import Section, quantity, separate_quantities

MOST_STAGES = 3


def _stages(value: object) -> object:
    """Return pairs of tooth counts from texts such as '23/67' or '23/67,19/81', from pairs, or from a list of these."""
    if isinstance(value, str):
        return _pairs(value)
    if isinstance(value, Sequence) and any(isinstance(item, str) for item in value):
        return [pair for item in value for pair in (_pairs(item) if isinstance(item, str) else [item])]
    if isinstance(value, Sequence) and len(value) == 2 and all(isinstance(item, int) for item in value):
        return [value]
    return value


def _pairs(text: str) -> list[tuple[int, int]]:
    return [_pair(part) for part in text.split(",")]


def _pair(text: str) -> tuple[int, int]:
    driving, _, driven = text.partition("/")
    try:
        return int(driving), int(driven)
    except ValueError:
        raise ValueError(f"{text.strip()!r} must be tooth counts of driving and driven gear, such as 23/67") from None


Pair = Annotated[tuple[int, int], Strict(False)]
Stages = Annotated[tuple[Pair, ...], Strict(False), BeforeValidator(_stages)]
Modules = Annotated[tuple[float, ...], Strict(False)]


class KnownNumbers(Section):
    """The numbers that are known of a transmission of one to three stages on parallel shafts."""

    teeth: Stages = quantity("-", "Tooth counts of driving and driven gear of each stage.", min_length=1)
    speed_rpm: float = quantity("rpm", "Speed of the driving shaft.", gt=0, le=2e5)
    torque: float = quantity("N m", "Mean torque on the driving shaft.", gt=0, le=2e4)
    module: Modules | None = quantity("m", "Normal module of all stages, or of each.", default=None)
    helix_angle_deg: float = quantity("deg", "Helix angle of all stages.", ge=0, le=45, default=0.0)

    @field_validator("module", mode="before")
    @classmethod
    def _listed(cls, value: object) -> object:
        """Return a list of modules from one module, or from texts such as '2 mm,3 mm'."""
        if isinstance(value, str):
            return separate_quantities(value)
        return value if value is None or isinstance(value, list | tuple) else [value]

    @model_validator(mode="after")
    def _stages_agree(self) -> "KnownNumbers":
        if len(self.teeth) > MOST_STAGES:
            raise ValueError(f"teeth names {len(self.teeth)} stages; a rig has at most {MOST_STAGES}")
        for count in (count for pair in self.teeth for count in pair):
            if not 8 <= count <= 400:
                raise ValueError(f"teeth = {count} must be from 8 to 400")
        modules = self.module or ()
        if self.module is not None and len(modules) not in (1, len(self.teeth)):
            raise ValueError(f"module has {len(modules)} values; give one for all stages, or {len(self.teeth)}")
        for module in modules:
            if not 2e-4 <= module <= 0.06:
                meant = f"; did you mean {module:g} mm?" if 0.2 <= module <= 60 else ""
                raise ValueError(f"module = {module:g} m must be from 0.0002 m to 0.06 m{meant}")
        return self

    def module_of(self, stage: int) -> float | None:
        """Return the normal module of a stage, from 0; None where it is not known."""
        return None if self.module is None else self.module[stage if len(self.module) > 1 else 0]
