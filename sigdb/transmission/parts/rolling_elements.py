"""Rolling elements of a bearing, and the orders at which their faults repeat."""

import math

from pydantic import model_validator

from sigdb.core import quantity
from sigdb.transmission.parts.described import Described


class RollingElements(Described):
    r"""Geometry of a rolling bearing with a fixed outer ring.

    Let N, d, D and a be the number of elements, their diameter, the pitch diameter and the contact angle, and
    :math:`g = d \cos a / D`. Without slip the faults repeat, per revolution of the shaft, at the orders ::

        FTF = (1 - g) / 2, BPFO = N FTF, BPFI = N (1 + g) / 2, BSF = D (1 - g^2) / (2 d).

    Real bearings slip by 1 to 2 %.

    References
    ----------
    .. [1] Randall, Antoni, "Rolling element bearing diagnostics - a tutorial", Mechanical Systems and Signal
       Processing 25(2), 2011, doi:10.1016/j.ymssp.2010.07.017, equations (1) to (4).

    Examples
    --------
    >>> bearing = RollingElements(elements=9, element_diameter=7.94e-3, pitch_diameter=39.04e-3)
    >>> {name: round(order, 3) for name, order in bearing.orders.items()}
    {'FTF': 0.398, 'BPFO': 3.585, 'BPFI': 5.415, 'BSF': 2.357}
    """

    elements: int = quantity("-", "Number of rolling elements in a row.", ge=3)
    element_diameter: float = quantity("m", "Diameter of an element.", gt=0)
    pitch_diameter: float = quantity("m", "Diameter of the circle of the elements' centres.", gt=0)
    contact_angle_deg: float = quantity("deg", "Contact angle.", ge=0, lt=90, default=0.0)

    @model_validator(mode="after")
    def _elements_fit(self) -> "RollingElements":
        room = math.pi * self.pitch_diameter / self.elements
        if self.element_diameter >= room:
            raise ValueError(
                f"element_diameter = {self.element_diameter:g} leaves no room for {self.elements} elements on a circle "
                f"of {self.pitch_diameter:g} m; it must be below {room:.3g} m"
            )
        return self

    @property
    def orders(self) -> dict[str, float]:
        """Orders of the faults per revolution of the shaft: ``FTF``, ``BPFO``, ``BPFI`` and ``BSF``."""
        g = self.element_diameter / self.pitch_diameter * math.cos(math.radians(self.contact_angle_deg))
        cage = (1 - g) / 2
        spin = self.pitch_diameter / (2 * self.element_diameter) * (1 - g**2)
        return {"FTF": cage, "BPFO": self.elements * cage, "BPFI": self.elements * (1 + g) / 2, "BSF": spin}
