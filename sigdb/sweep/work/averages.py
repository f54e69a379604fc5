"""Averages of rows: a template, turned to its tooth, with a specimen and noise, without simulation.

Where a turn is exact, a row with damage at tooth t is ``roll(y_D + Y_D roll(e, -(t - 1)), (t - 1) n / teeth)``, with e
the index errors of the specimen. Harmonic excitations are fixed to the shaft: in the template they turn by
``-(t - 1) 360 / teeth`` deg. Where no turn is exact, every tooth has its own template and nothing turns.
"""

from collections.abc import Iterable, Mapping
from math import isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sigdb.core import SIGNALS_AT_ONCE, BoolArray, FloatArray, IntArray, blocks, specimen_stream
from sigdb.database import StatusCode, Template
from sigdb.dynamics import superpose
from sigdb.measurement import (
    MOST_MODES,
    NuisanceMixture,
    coloured,
    drawn_colours,
    index_errors,
    late,
    measured_noise,
    noise_deviation,
    revolution_scatter,
    whole_mean,
)
from sigdb.sweep.plan.plan import Plan, RigPoint
from sigdb.sweep.work.templates import TemplateReader

Cases = Mapping[str, NDArray[Any]]
"""Columns of rows by name, with at least those of :data:`CASE_COLUMNS`."""
CASE_COLUMNS = ("id", "template", "teeth", "tooth", "specimen", "averages", "snr_db", "index_error")
"""Columns of a case that determine its average."""

_NOT_TURNED = (
    "the mesh loses contact, and unbalance, run-out or a fluctuating load act in addition: the motion with "
    "damage at one tooth is not that at another turned; reduce the damage, or leave those out"
)


class SpecimenErrors:
    """Index errors of the specimens of a sweep, each drawn on first use and kept as long as this object.

    Parameters
    ----------
    seed
        Seed of the plan.
    runout
        Amplitude of the slow orders of the errors, over ``index_error``.
    """

    def __init__(self, seed: int, runout: float = 0.0) -> None:
        self._seed, self._runout = seed, runout
        self._drawn: dict[tuple[int, int, int], FloatArray] = {}

    def draw(self, specimens: Iterable[int], teeth: int, mate_teeth: int) -> FloatArray:
        """Return the (specimens, teeth) index errors of specimens with an rms index error of 1 m."""
        return np.array([self._of_specimen(specimen, teeth, mate_teeth) for specimen in specimens])

    def _of_specimen(self, specimen: int, teeth: int, mate_teeth: int) -> FloatArray:
        key = specimen, teeth, mate_teeth
        if key not in self._drawn:
            stream = specimen_stream(self._seed, specimen)
            self._drawn[key] = index_errors(stream, teeth, mate_teeth, runout=self._runout)
        return self._drawn[key]


class Averages:
    """Synchronous averages of some rows of the same tooth count.

    Parameters
    ----------
    plan
        The plan of the rows.
    templates
        Reader of their templates.
    errors
        Index errors of the plan's specimens.
    cases
        Columns of the rows.
    stream
        Stream of the noise.

    Attributes
    ----------
    status
        (rows,) ``ok``, or why there is no result.
    status_code
        (rows,) short form of the status; None where the template has none.
    least
        (rows,) least compression of the mesh as a fraction of the static compression; nan where it is not known.
    least_force
        (rows,) least force of the mesh as a fraction of the static force; nan where it is not known.
    contact_loss
        (rows,) whether the mesh loses contact; None where it is not known.
    index_error
        (rows,) rms index error in the average, m; 0 where its template has lost contact.
    tsa
        (rows, sensors, n) averages, float32; of no meaning in rows without a result.
    scatter
        (rows, sensors) measured standard deviation between revolutions, in the unit of the signal.
    noise, noise_colour
        (rows, sensors, n / 2 + 1) measured noise of the average by order, in the unit of the signal, and (rows,
        sensors) number of its colour, 0 for white noise. None where all noise is white.
    """

    def __init__(
        self,
        plan: Plan,
        templates: TemplateReader,
        errors: SpecimenErrors,
        cases: Cases,
        stream: np.random.Generator,
    ) -> None:
        self._plan, self._errors, self._cases = plan, errors, cases
        rows, sensors = len(cases["id"]), len(plan.sensors)
        self.teeth = int(cases["teeth"][0])
        n = self.teeth * plan.signature.samples_per_tooth
        self.status = np.full(rows, "ok", dtype=object)
        self.status_code = np.full(rows, StatusCode.OK.value, dtype=object)
        self.least = np.full(rows, np.nan)
        self.least_force = np.full(rows, np.nan)
        self.contact_loss = np.full(rows, None, dtype=object)
        self.index_error = cases["index_error"].copy()
        self.tsa = np.empty((rows, sensors, n), dtype=np.float32)
        # Every row's noise is drawn, whether it will have a result or not: a row depends on nothing but its id.
        self._white: FloatArray = stream.standard_normal((rows, sensors, n))
        self.scatter: FloatArray = revolution_scatter(stream, np.ones((rows, sensors)), n, cases["averages"][:, None])
        if plan.nuisance.exist:
            self._mixture = NuisanceMixture.of(plan.nuisance)
            self._nuisances = stream.standard_normal((rows, MOST_MODES))
            self._part, self._late = self._mixture.draw(stream, rows)
        self.noise: FloatArray | None = None
        self.noise_colour: IntArray | None = None
        if plan.nuisance.colour_db:
            self._draw_colours(stream)
        for number in np.unique(cases["template"]):
            point = plan.rig_points[plan.case(int(number)).rig_point]
            here = np.flatnonzero(cases["template"] == number)
            for some in blocks(len(here), SIGNALS_AT_ONCE):
                self._fill(templates[int(number)], point, here[some])

    def _draw_colours(self, stream: np.random.Generator) -> None:
        """Colour the noise of machines that have a nuisance, and measure it by order."""
        settings, (rows, sensors, n) = self._plan.nuisance, self._white.shape
        number = stream.integers(1, settings.colours + 1, (rows, sensors))
        self.noise_colour = np.where(stream.random((rows, 1)) < settings.none, 0, number)
        shapes = drawn_colours(settings, self._plan.seed, n, self.teeth)[self.noise_colour]
        self._white = coloured(self._white, shapes)
        averages = self._cases["averages"][:, None]
        by_order = measured_noise(stream, shapes, averages[:, :, None])
        self.scatter = np.sqrt(whole_mean(by_order**2))
        self.noise = by_order / np.sqrt(averages[:, :, None])

    @property
    def done(self) -> BoolArray:
        """(rows,) whether there is a result."""
        return np.asarray(self.status == "ok")

    def _fill(self, template: Template, point: RigPoint, rows: IntArray) -> None:
        """Compute the averages of rows of the same template."""
        self.least[rows], self.contact_loss[rows] = template.min_compression, template.contact_loss
        self.least_force[rows] = template.min_mesh_force
        turns = self._cases["tooth"][rows] - template.tooth
        if template.status != "ok":
            self.status[rows], self.status_code[rows] = template.status, template.status_code
            return
        if template.contact_loss:
            if len(template.orders):
                turned = rows[turns != 0]
                self.status[turned], self.status_code[turned] = _NOT_TURNED, StatusCode.NOT_TURNED.value
            rows, turns = (some[self.status[rows] == "ok"] for some in (rows, turns))
            self.index_error[rows] = 0.0
            clean = np.broadcast_to(template.signals, (len(rows), *template.signals.shape))
        else:
            clean = self._with_specimens(template, point, rows, turns)
        self._measure(template, clean, rows, turns)

    def _with_specimens(self, template: Template, point: RigPoint, rows: IntArray, turns: IntArray) -> FloatArray:
        """Return (rows, sensors, n) clean averages before their turn; rows that lose contact by their specimen fail."""
        errors = _turn_back(self._index_errors(point, rows), turns)
        phases = _phases(template.orders, turns * 2 * np.pi / point.teeth)
        clean = superpose(template.signals, template.specimen_response, template.harmonic_response, errors, phases)
        if self._plan.nuisance.exist:
            factors = self._mixture.factors(template.nuisance_counts.tolist())[self._part[rows]]
            amounts = factors * self._nuisances[rows, : factors.shape[1]]
            clean += np.einsum("rm,snm->rsn", amounts, template.nuisance_modes, optimize=True)
            clean = late(clean, self._late[rows], self.teeth)
        compression = superpose(
            template.relative_compression,
            template.relative_compression_response,
            template.relative_compression_harmonic,
            errors,
            phases,
        )
        self.least[rows] = np.minimum(compression.min(axis=1), template.least_elsewhere)
        if isnan(template.static_force):  # of an earlier version, which took the compression for the mesh force
            self.least_force[rows] = self.least[rows]
        else:
            force = superpose(
                template.relative_mesh_force,
                template.relative_mesh_force_response,
                template.relative_mesh_force_harmonic,
                errors,
                phases,
            )
            self.least_force[rows] = np.minimum(force.min(axis=1), template.least_force_elsewhere)
        lost = self.least_force[rows] <= 0
        self.contact_loss[rows] = lost
        self.status_code[rows[lost]] = StatusCode.CONTACT.value
        for row in rows[lost]:
            self.status[row] = _contact_loss_status(self.least_force[row])
        return clean

    def _measure(self, template: Template, clean: FloatArray, rows: IntArray, turns: IntArray) -> None:
        """Turn the clean averages to their teeth and add the noise."""
        deviation = noise_deviation(template.reference_variance, self._cases["snr_db"][rows, None])
        self.scatter[rows] *= deviation
        if self.noise is not None:
            self.noise[rows] *= deviation[:, :, None]
        noise = self._white[rows] * (deviation / np.sqrt(self._cases["averages"][rows, None]))[:, :, None]
        for turn in np.unique(turns):
            at = turns == turn
            samples = int(turn) * self._plan.signature.samples_per_tooth
            self.tsa[rows[at]] = np.roll(clean[at], samples, axis=-1) + noise[at]

    def _index_errors(self, point: RigPoint, rows: IntArray) -> FloatArray:
        """Return the (rows, teeth) index errors of the rows' specimens, m."""
        specimens = self._cases["specimen"][rows].tolist()
        unit = self._errors.draw(specimens, point.teeth, point.mate_teeth)
        return unit * self._cases["index_error"][rows, None]


def _phases(orders: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the (rows, orders, 2) cosine and sine of each order's phase in a frame turned by an angle."""
    phase = angles[:, None] * orders
    return np.stack([np.cos(phase), np.sin(phase)], axis=-1)


def _turn_back(rows: FloatArray, turns: IntArray) -> FloatArray:
    """Return each row (n,) rolled back by its number of places."""
    n = rows.shape[1]
    return np.take_along_axis(rows, (np.arange(n) + turns[:, None]) % n, axis=1)


def _contact_loss_status(min_mesh_force: float) -> str:
    """Return the status of a row whose specimen, unlike its template, opens a mesh."""
    return (
        f"with this specimen the mesh loses contact (least mesh force {min_mesh_force:.3f} of the static one), where "
        "the linear solution does not hold; reduce the damage or the index errors, or raise the torque"
    )
