"""Settings of a database of recordings as defaults for another recording of the machine."""

from dataclasses import dataclass
from os import PathLike
from typing import Any

from sigdb.database import Store, read_manifest
from sigdb.ingest.plan import stored_plans
from sigdb.transmission import Transmission


@dataclass(frozen=True, kw_only=True)
class DatabaseDefaults:
    """Defaults for a recording, from the first ingest of a database.

    Attributes
    ----------
    rig
        The rig; None without one, or where recordings have different ones.
    teeth
        Tooth counts, where there is no rig.
    gear
        The averaged gear, where it is one.
    reading, averaging
        Options of reading and of averaging.
    samples_per_tooth
        Samples of an average in a tooth pass.
    """

    rig: Transmission | None
    teeth: str | None
    gear: str | None
    reading: dict[str, Any]
    averaging: dict[str, Any]
    samples_per_tooth: int


def database_defaults(location: str | PathLike[str]) -> DatabaseDefaults:
    """Return the settings of a database of recordings that hold for all of them.

    Raises
    ------
    InputError
        If there is no database.
    DatabaseError
        If its description is damaged.
    """
    store = Store.at(location)
    plan = stored_plans(read_manifest(store).plans[:1], store)[0]
    facts = [each for recording in plan.recordings for each in recording.facts]
    rigs = {each.rig or plan.settings.rig for each in facts}
    teeth = {each.teeth or plan.settings.teeth for each in facts}
    gears = {each.gear or "+".join(plan.settings.gears) for each in facts}
    rig, counts, gear = (next(iter(values)) if len(values) == 1 else None for values in (rigs, teeth, gears))
    return DatabaseDefaults(
        rig=None if rig is None else plan.rigs[rig],
        teeth=counts if rig is None else None,
        gear=gear if gear and "+" not in gear else None,
        reading=plan.settings.reading.model_dump(exclude_unset=True),
        averaging=plan.settings.averaging.model_dump(exclude_unset=True),
        samples_per_tooth=plan.settings.samples_per_tooth,
    )
