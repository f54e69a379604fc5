"""Averages of rows: a template, turned to its tooth, with a specimen and noise. No simulation.

Where a turn is exact, a row with damage at tooth t is ``roll(y_D + Y_D roll(e, -(t - 1)), (t - 1) n / teeth)``, e the
specimen's index errors; harmonic excitations, fixed to the shaft, turn by ``-(t - 1) 360 / teeth`` deg in the template.
Else every tooth has its own template and nothing turns.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sigdb.core import BoolArray, FloatArray, IntArray, specimen_stream
from sigdb.database import Template
from sigdb.dynamics import superpose
from sigdb.measurement import index_errors, noise_deviation, revolution_scatter
from sigdb.sweep.plan.plan import Plan, RigPoint
from sigdb.sweep.work.template_reader import TemplateReader
from sigdb.sweep.work.templates import contact_loss_sentence

Cases = Mapping[str, NDArray[Any]]
"""Columns of rows, by name: those of the plan that `CASE` names."""
CASE = ("id", "template", "teeth", "tooth", "specimen", "averages", "snr_db", "index_error")
"""What of its case a row's average depends on."""

_ROWS_AT_ONCE = 32
"""Rows made together: their arrays stay in the cache, and in memory that the process has already."""
_BESIDE = (
    "the mesh loses contact, and unbalance, run-out or a fluctuating load act beside the damage: the motion with "
    "damage at one tooth is not that at another turned; reduce the damage, or leave those out"
)


class Averages:
    """The synchronous averages of some rows of one tooth count.

    Attributes
    ----------
    status
        (rows,) ``ok``, or why there is no result.
    least
        (rows,) least compression of the mesh as a fraction of the static one; nan where it is not known.
    contact_loss
        (rows,) whether the mesh loses contact; None where it is not known.
    index_error
        (rows,) size of the index errors that are in the average, m: none where its template has lost contact.
    tsa
        (rows, sensors, n) averages, float32; of no meaning in rows without a result.
    scatter
        (rows, sensors) measured standard deviation between revolutions, in the unit of the signal.
    """

    def __init__(self, plan: Plan, bank: TemplateReader, cases: Cases, stream: np.random.Generator) -> None:
        self._plan, self._cases = plan, cases
        rows, sensors = len(cases["id"]), len(plan.sensors)
        self.teeth = int(cases["teeth"][0])
        n = self.teeth * plan.signature.samples_per_tooth
        self.status = np.full(rows, "ok", dtype=object)
        self.least = np.full(rows, np.nan)
        self.contact_loss = np.full(rows, None, dtype=object)
        self.index_error = cases["index_error"].copy()
        self.tsa = np.empty((rows, sensors, n), dtype=np.float32)
        # Every row's noise is drawn, whether it will have a result or not: a row depends on nothing but its id.
        self._white = stream.standard_normal((rows, sensors, n))
        self.scatter = revolution_scatter(stream, np.ones((rows, sensors)), n, cases["averages"][:, None])
        for number in np.unique(cases["template"]):
            point = plan.rig_points[plan.case(int(number)).rig_point]
            here = np.flatnonzero(cases["template"] == number)
            for first in range(0, len(here), _ROWS_AT_ONCE):
                self._fill(bank[int(number)], point, here[first : first + _ROWS_AT_ONCE])

    @property
    def done(self) -> BoolArray:
        """(rows,) whether there is a result."""
        return np.asarray(self.status == "ok")

    def _fill(self, template: Template, point: RigPoint, rows: IntArray) -> None:
        """The averages of the rows of one template."""
        self.least[rows], self.contact_loss[rows] = template.min_compression, template.contact_loss
        turns = self._cases["tooth"][rows] - template.tooth
        if template.status != "ok":
            self.status[rows] = template.status
            return
        if template.contact_loss:
            if len(template.orders):
                self.status[rows[turns != 0]] = _BESIDE
            rows, turns = (some[self.status[rows] == "ok"] for some in (rows, turns))
            self.index_error[rows] = 0.0
            clean = np.broadcast_to(template.signals, (len(rows), *template.signals.shape))
        else:
            clean = self._with_specimens(template, point, rows, turns)
        self._measure(template, clean, rows, turns)

    def _with_specimens(self, template: Template, point: RigPoint, rows: IntArray, turns: IntArray) -> FloatArray:
        """(rows, sensors, n) clean averages, not turned yet; rows that lose contact by their specimen fail."""
        errors = _turned(self._index_errors(point, rows), turns)
        phases = _phases(template.orders, turns * 2 * np.pi / point.teeth)
        clean = superpose(template.signals, template.specimen_response, template.harmonic_response, errors, phases)
        compression = superpose(
            template.relative_compression,
            template.relative_compression_response,
            template.relative_compression_harmonic,
            errors,
            phases,
        )
        least = np.minimum(compression.min(axis=1), template.least_elsewhere)
        self.least[rows], self.contact_loss[rows] = least, least < 0
        for row in rows[least < 0]:
            self.status[row] = contact_loss_sentence(self.least[row])
        return clean

    def _measure(self, template: Template, clean: FloatArray, rows: IntArray, turns: IntArray) -> None:
        """Turn the clean averages to their teeth and add the noise."""
        deviation = noise_deviation(template.reference_variance, self._cases["snr_db"][rows, None])
        self.scatter[rows] *= deviation
        noise = self._white[rows] * (deviation / np.sqrt(self._cases["averages"][rows, None]))[:, :, None]
        for turn in np.unique(turns):
            at = turns == turn
            samples = int(turn) * self._plan.signature.samples_per_tooth
            self.tsa[rows[at]] = np.roll(clean[at], samples, axis=-1) + noise[at]

    def _index_errors(self, point: RigPoint, rows: IntArray) -> FloatArray:
        """(rows, teeth) index errors of the rows' specimens, m."""
        specimens = self._cases["specimen"][rows].tolist()
        unit = [_specimen(self._plan.seed, one, point.teeth, point.mate_teeth) for one in specimens]
        return np.array(unit) * self._cases["index_error"][rows, None]


def _phases(orders: FloatArray, angles: FloatArray) -> FloatArray:
    """(rows, orders, 2) cosine and sine of each order's phase in a frame turned by an angle."""
    phase = angles[:, None] * orders
    return np.stack([np.cos(phase), np.sin(phase)], axis=-1)


@lru_cache(maxsize=65536)
def _specimen(seed: int, specimen: int, teeth: int, mate_teeth: int) -> FloatArray:
    return index_errors(specimen_stream(seed, specimen), teeth, mate_teeth)


def _turned(rows: FloatArray, turns: IntArray) -> FloatArray:
    """Each row (n,) rolled back by its own number of places."""
    n = rows.shape[1]
    return np.take_along_axis(rows, (np.arange(n) + turns[:, None]) % n, axis=1)
