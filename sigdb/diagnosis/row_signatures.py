"""Signatures of measured rows of a database, as a diagnosis compares them."""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import FloatArray, InputError
from sigdb.database import Database
from sigdb.diagnosis.change.average_spectrum import LEAST_GROUPS
from sigdb.recording import EnvelopeSpectrum, MeshPresence, RecordedSignature

_MOST_GROUPS = 24
"""Most groups of revolutions of a signature."""

_NOTHING = EnvelopeSpectrum(
    band=(0.0, 0.0), chosen="not stored", kurtosis=0.0, spectrum=pd.DataFrame(), lines=pd.DataFrame()
)


def row_signature(database: Database, ids: Sequence[int], facts: Mapping[Hashable, Any]) -> RecordedSignature:
    """Return the signature of the averages of one recording by one gear and channel.

    Their groups of revolutions are joined; tables that no diagnosis reads are empty.

    Parameters
    ----------
    database
        A database of recordings.
    ids
        Ids of the rows.
    facts
        Columns of the first of them.

    Raises
    ------
    InputError
        If the rows are simulated, so that they have no groups of revolutions.
    """
    if "groups" not in database.dataset("signals").schema.names:
        raise InputError(f"{database.store} holds simulated rows, which have no revolutions; give one of recordings")
    n = int(facts["samples"])
    rows = database.signal_rows(np.sort(np.asarray(ids, np.int64)), ["groups", "noise"])
    groups = rows["groups"].combine_chunks().flatten().to_numpy().astype(float).reshape(-1, n)
    noise = np.asarray(rows["noise"][0].as_py(), float) / np.sqrt(len(ids))
    empty = pd.DataFrame()
    return RecordedSignature(
        source=str(facts["recording"]),
        channel=str(facts["channel"]),
        unit=str(facts["unit"]),
        gear=str(facts["gear"]) or None,
        shaft=None,
        teeth=int(facts["teeth"]),
        angle=str(facts["angle"]),
        absolute=bool(facts["absolute"]),
        tsa=groups.mean(axis=0),
        scatter=float(facts["scatter"]),
        noise=noise,
        groups=_joined(groups),
        averages=int(facts["averages"]) * len(ids),
        dropped=0,
        cycle=None,
        speed_rpm=float(facts["shaft_rpm"]),
        speed_track=empty,
        kept=float(facts["kept"]),
        presence=MeshPresence(present=True, reason="the mesh stood out", p_value=float(facts["presence_p"])),
        highest_order=float(facts["highest_order"]),
        order_spectrum=empty,
        record_spectrum=empty,
        lines=empty,
        indicators={},
        intervals=empty,
        envelope=_NOTHING,
        shafts=empty,
        order_map=None,
        notes=(),
    )


def _joined(groups: FloatArray) -> FloatArray:
    """Return at most 24 groups, each the mean of as many consecutive ones."""
    size = max(1, -(-len(groups) // _MOST_GROUPS))
    count = max(len(groups) // size, min(len(groups), LEAST_GROUPS))
    return np.array([part.mean(axis=0) for part in np.array_split(groups, count)])
