"""Roles of columns: what a model may read, what it is to answer, and what would be the answer by another way."""

from enum import StrEnum

from sigdb.database.splits.names import MEMBER
from sigdb.transmission import ToothDamage


class Role(StrEnum):
    """The role of a column for a model.

    A model that is to work on measurements reads inputs only.
    """

    INPUT = "input"
    """A measurement has it: the operating point, the average, and all that is computed from it."""
    LABEL = "label"
    """The damage, or what an inspection found."""
    ID = "id"
    """The origin of a row: its number, specimen, recording, and how it was made."""
    TRUTH = "truth"
    """A number of the simulation that no measurement has, such as the true noise."""


_ROLES = {
    Role.INPUT: ("teeth", "speed_rpm", "torque", "load", "shaft_rpm", "averages", "scatter", "noise", "tsa", "spectrum",
                 "groups"),
    Role.LABEL: ("tooth", "damaged_teeth", "pattern", *ToothDamage.model_fields, "state", "health", "kind", "severity",
                 "label_trust"),
    Role.ID: ("id", "status", "status_code", "template", "gear", "shaft", "specimen", "draw", "source", "recording",
              "sha256", "set", "machine", "specimen_name", "sensor", "channel", "unit", "date", "begin", "rig", "angle",
              "absolute", "life_number",
              "life_time", "kept", "highest_order", "presence_p", "notes", MEMBER),
    Role.TRUTH: ("snr_db", "noise_colour", "index_error", "min_compression", "min_mesh_force", "contact_loss"),
}  # fmt: skip
_ROLE_OF = {name: role for role, names in _ROLES.items() for name in names}


def role_of(name: str) -> Role:
    """Return the role of a column of ``features`` or ``signals``.

    Swept parameters of the rig, which have dotted names, are truth. All other columns without an entry are computed
    from the average: features, indicators, and what functions of a user have added.

    Examples
    --------
    >>> str(role_of("tooth")), str(role_of("fm4__housing")), str(role_of("bearings.front.stiffness"))
    ('label', 'input', 'truth')
    """
    plain = name.partition("__")[0]
    return _ROLE_OF.get(plain, Role.TRUTH if "." in plain else Role.INPUT)
