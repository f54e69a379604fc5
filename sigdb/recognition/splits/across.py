"""Models of simulated rows on measured ones: what must agree, and what the rows are taken for."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from sigdb.core import InputError, Note
from sigdb.database import MEASURED_SENSOR, Database
from sigdb.recognition.model import Model

_FACTS = ("sensor", "unit", "label_trust")


def check_across(model: Model, database: Database, rows: pd.DataFrame) -> None:
    """Refuse measured rows that a model of simulated rows cannot answer, or the other way round.

    Parameters
    ----------
    model
        A trained model.
    database
        The database of the rows.
    rows
        The rows, by id.

    Raises
    ------
    InputError
        If the rows are of several sensors, in another unit, of other tooth counts, or of another number of samples.
    """
    store = database.store
    trained = model.trained_range
    if trained is not None:
        samples = int(database.manifest.resolved["signature"]["samples_per_tooth"])
        if samples != trained.samples_per_tooth:
            raise InputError(
                f"{store} has averages of {samples} samples a tooth, and the model reads {trained.samples_per_tooth}; "
                f"ingest with --samples-per-tooth {trained.samples_per_tooth}"
            )
    teeth = sorted({int(count) for count in rows["teeth"]})
    if model.teeth and not set(teeth) & set(model.teeth):
        raise InputError(
            f"{store} has gears of {_listed(teeth)} teeth, and the model was trained on {_listed(model.teeth)}; train "
            "on simulated rows of these tooth counts, or select others with --where"
        )
    if model.sensor == MEASURED_SENSOR:
        return
    facts = _facts(database, rows)
    sensors = sorted(facts["sensor"].unique())
    if len(sensors) > 1:
        raise InputError(
            f"{store} has rows of the sensors {_listed(sensors)}, and the model reads one ({model.sensor}); select it, "
            f"such as --where \"sensor = '{sensors[0]}'\""
        )
    units = sorted(set(facts["unit"]) - {""})
    if trained is not None and trained.unit and units and units != [trained.unit]:
        raise InputError(
            f"{store} has averages in {_listed(units)}, and the model reads {trained.unit}; state the unit and the "
            "sensitivity of the sensor at the ingest"
        )


def across_notes(model: Model, database: Database, rows: pd.DataFrame) -> list[Note]:
    """Return notes on what measured rows are taken for by a model of simulated rows, and how far they are outside.

    Parameters
    ----------
    model, database, rows
        As in :func:`check_across`.
    """
    if model.sensor == MEASURED_SENSOR or not database.manifest.is_measured:
        return []
    facts = _facts(database, rows)
    trust = facts["label_trust"].replace("", "unknown").value_counts().to_dict()
    labels = ", ".join(f"{count} {name}" for name, count in trust.items())
    teeth = sorted({int(count) for count in rows["teeth"]})
    text = (
        f"The sensor {facts['sensor'].iloc[0]} is taken for {model.sensor}, gears of {_listed(teeth)} teeth for those "
        f"of the model, and tooth 1 for the first after the tacho's mark; labels: {labels}. Gain and path stay."
    )
    notes = [Note(code="mapping", text=text, values={"sensor": str(facts["sensor"].iloc[0]), "labels": labels})]
    if model.trained_range is not None:
        reasons = model.trained_range.row_reasons(database, rows)
        outside = [reason for reason in reasons if reason]
        if outside:
            share = len(outside) / len(reasons)
            text = (
                f"{100 * share:.0f} % of the rows lie outside the range that the model was trained in, such as: "
                f"{outside[0]}."
            )
            notes.append(Note(code="outside-training", text=text, values={"share": share}))
    return notes


def _facts(database: Database, rows: pd.DataFrame) -> pd.DataFrame:
    """Return sensor, unit and trust of rows."""
    stored = database.sql(f"select id, {', '.join(_FACTS)} from cases").set_index("id")
    return stored.loc[np.asarray(rows.index)].fillna("")


def _listed(values: Sequence[object]) -> str:
    return ", ".join(map(str, values))
