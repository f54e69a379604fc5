"""Geometry of a rolling bearing, and the orders at which its faults repeat."""

import math
from typing import Self

from pydantic import model_validator

from sigdb.core import quantity
from sigdb.transmission.parts.described import Described


class RollingBearing(Described):
    """Geometry of a rolling bearing whose outer ring stands still; the passing orders follow from it.

    With n rolling elements, ``r = d/D cos(contact angle)`` and one revolution of the shaft: outer race
    ``n/2 (1 - r)``, inner race ``n/2 (1 + r)``, cage ``1/2 (1 - r)``, and a rolling element's spin
    ``D/(2 d) (1 - r^2)``, without slip (published: Randall, Antoni 2011, doi:10.1016/j.ymssp.2010.07.017).

    Examples
    --------
    The bearing 6205 of a much used test rig:

    >>> bearing = RollingBearing(rolling_elements=9, rolling_diameter=7.94e-3, pitch_diameter=39.04e-3)
    >>> round(bearing.outer, 3), round(bearing.inner, 3)
    (3.585, 5.415)
    """

    rolling_elements: int = quantity("-", "Number n of rolling elements.", ge=1)
    rolling_diameter: float = quantity("m", "Diameter d of a rolling element.", gt=0)
    pitch_diameter: float = quantity("m", "Diameter D of the circle of their centres.", gt=0)
    contact_angle_deg: float = quantity("deg", "Contact angle, 0 for a radial bearing.", ge=0, lt=90, default=0.0)

    @model_validator(mode="after")
    def _elements_fit(self) -> Self:
        room = self.pitch_diameter * (math.sin(math.pi / self.rolling_elements) if self.rolling_elements > 1 else 1.0)
        if self.rolling_diameter > room:
            raise ValueError(
                f"rolling_diameter = {self.rolling_diameter:g} leaves no room for {self.rolling_elements} elements on "
                f"a circle of {self.pitch_diameter:g} m; it must be at most {room:.3g} m"
            )
        return self

    @property
    def _r(self) -> float:
        return self.rolling_diameter / self.pitch_diameter * math.cos(math.radians(self.contact_angle_deg))

    @property
    def outer(self) -> float:
        """Order at which elements pass a point of the outer race (BPFO)."""
        return self.rolling_elements / 2 * (1 - self._r)

    @property
    def inner(self) -> float:
        """Order at which elements pass a point of the inner race (BPFI)."""
        return self.rolling_elements / 2 * (1 + self._r)

    @property
    def cage(self) -> float:
        """Order of the cage (FTF)."""
        return (1 - self._r) / 2

    @property
    def spin(self) -> float:
        """Order at which an element turns about itself (BSF)."""
        return self.pitch_diameter / (2 * self.rolling_diameter) * (1 - self._r**2)

    @property
    def orders(self) -> dict[str, float]:
        """Orders of the faults by their usual abbreviations."""
        return {"FTF": self.cage, "BPFO": self.outer, "BPFI": self.inner, "BSF": self.spin}
