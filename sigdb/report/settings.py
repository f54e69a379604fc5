"""The section ``[report]`` of a recipe."""

from sigdb.core.fields import Section, quantity


class Report(Section):
    """How pictures look."""

    mesh_orders: float = quantity("-", "Highest order shown, as a multiple of the tooth count.", ge=1, default=4.0)
    dots_per_inch: int = quantity("1/inch", "Resolution of PNG files.", ge=50, le=600, default=110)
