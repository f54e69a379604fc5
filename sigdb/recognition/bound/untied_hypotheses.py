"""Laws of averages in trains, where damage at another tooth is another template and not a turn of the first."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, IntArray, NotApplicableError
from sigdb.database import Database, rig_of
from sigdb.recognition.templates.hypotheses import Hypotheses
from sigdb.recognition.templates.turned_laws import TurnedLaws


@dataclass(frozen=True, kw_only=True, eq=False)
class UntiedHypotheses(Hypotheses):
    """The laws of an average of a rig with several meshes, at one operating point.

    As :class:`Hypotheses`, but each template is of damage at the tooth of its case, from the tacho mark, and of no
    other. The log-likelihood at other teeth is -inf.
    """

    @classmethod
    def of_hypotheses(cls, laws: Hypotheses) -> Self:
        """Return the laws of templates that are not to be turned."""
        return cls(**{name: getattr(laws, name) for name in laws.__dataclass_fields__})

    @property
    def tooth(self) -> IntArray:
        """(templates,) first damaged tooth, 0 for a healthy gear."""
        return self.cases["tooth"].to_numpy(int)

    @property
    def turned(self) -> TurnedLaws:
        """There are none.

        Raises
        ------
        NotApplicableError
            Always.
        """
        raise NotApplicableError("the rig has several meshes, so that its templates are not to be turned")

    @cached_property
    def _unturned(self) -> TurnedLaws:
        """The laws of the templates as they are: of a gear of one tooth, as far as turns go."""
        carriers = np.concatenate([self.signal[:, :, None], self.harmonic], axis=2).transpose(0, 2, 1)
        phases = np.concatenate([np.ones((len(self.signal), 1, 1)), self.phases[:, :, :1]], axis=1)
        return TurnedLaws(
            teeth=1,
            healthy=self.healthy,
            modes=self.modes,
            gains=self.gains,
            carriers=carriers[:, None],
            phases=phases,
        )

    def log_likelihood(self, x: ArrayLike, *, noise: ArrayLike, index_error: ArrayLike) -> FloatArray:
        """Logarithm of the density of averages under each template, at its own tooth only.

        Parameters
        ----------
        x, noise, index_error
            As of :meth:`Hypotheses.log_likelihood`.

        Returns
        -------
        ndarray, (rows, templates, teeth)
            -inf at other teeth; the same for all teeth for a healthy gear.
        """
        density = self._unturned.log_likelihood(x, noise=noise, index_error=index_error)[:, :, 0]
        likelihood = np.full((*density.shape, self.teeth), -np.inf)
        likelihood[:, self.healthy] = density[:, self.healthy, None]
        damaged = np.flatnonzero(~self.healthy)
        likelihood[:, damaged, self.tooth[damaged] - 1] = density[:, damaged]
        return likelihood

    def draw(
        self,
        stream: np.random.Generator,
        template: IntArray,
        tooth: IntArray,
        *,
        noise: ArrayLike,
        index_error: ArrayLike,
    ) -> FloatArray:
        """Draw averages from the law, each with a specimen and noise of its own; see :meth:`Hypotheses.draw`.

        ``tooth`` is that of the template.
        """
        first = np.ones(len(template), int)
        return super().draw(stream, template, first, noise=noise, index_error=index_error)


def hypotheses_at(
    database: Database, *, speed_rpm: float, torque: float, teeth: int, sensor: str | None = None
) -> Hypotheses:
    """Return the hypotheses of a database at an operating point, turned or one for each tooth as the rig asks for.

    Parameters
    ----------
    database, speed_rpm, torque, teeth, sensor
        As of :meth:`Hypotheses.of`.

    Raises
    ------
    InputError
        If there is no such template.
    """
    rig, gear = rig_of(database)
    untied = not rig.turns_exactly(gear)
    laws = Hypotheses.of(database, speed_rpm=speed_rpm, torque=torque, teeth=teeth, sensor=sensor, untied=untied)
    return UntiedHypotheses.of_hypotheses(laws) if untied else laws
