"""Laws of averages at any operating point of a bank of templates, for averages that are fused."""

from collections.abc import Sequence

import numpy as np

from sigdb.core import FloatArray, NotApplicableError
from sigdb.recognition.fusion.joint_law import NOT_FUSED, NOT_TURNED, AverageLaw, DamageKey
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.point_templates import PointTemplates, TemplateKey, stored_signals, template_keys
from sigdb.recognition.templates.speed_curve import Interpolation, SpeedCurve


class BankLaws:
    """Laws of averages at operating points of a bank; each is made once.

    Parameters
    ----------
    bank
        Templates of one sensor.
    """

    def __init__(self, bank: TemplateBank) -> None:
        self._bank = bank
        self._laws_at: dict[tuple[float, float, int], AverageLaw] = {}
        self._curves: dict[int, tuple[SpeedCurve, list[TemplateKey]]] = {}

    def at(self, speed_rpm: float, torque: float, teeth: int) -> AverageLaw:
        """Return the law at an operating point, or at the nearest one of a bank that does not interpolate.

        Raises
        ------
        NotApplicableError
            If the bank has no such tooth count, has nuisances, or templates that are not turned.
        """
        if any(stored.nuisance is not None for stored in self._bank.points):
            raise NotApplicableError(NOT_FUSED)
        if any(stored.tooth is not None for stored in self._bank.points):
            raise NotApplicableError(NOT_TURNED)
        point = speed_rpm, torque, teeth
        if point not in self._laws_at:
            between = [each for each in self._bank.interpolations if each.teeth == teeth]
            if between:
                self._laws_at[point] = self._interpolated(between[0], speed_rpm, torque)
            else:
                (place,) = self._bank.nearest(*(np.array([value]) for value in point))
                stored = self._bank.points[place]
                self._laws_at[point] = self._law([stored], list(template_keys(stored)), stored.signals.expanded())
        return self._laws_at[point]

    def _interpolated(self, between: Interpolation, speed_rpm: float, torque: float) -> AverageLaw:
        points = [point for point in self._bank.points if point.teeth == between.teeth]
        if between.teeth not in self._curves:
            between.check()
            stored = stored_signals(points)
            if stored is None:
                raise NotApplicableError(f"the bank has too few templates of {between.teeth} teeth; train it again")
            curve = SpeedCurve(stored[0], between.signal_powers, between.harmonic_powers)
            self._curves[between.teeth] = curve, stored[1]
        curve, keys = self._curves[between.teeth]
        speed = np.clip([speed_rpm], *between.speed_rpm)
        coefficients = curve.signals(speed, np.array([torque]))[0]
        kept = np.flatnonzero(np.isfinite(coefficients[:, 0, 0]))
        signals = coefficients[kept] @ points[0].signals.basis.astype(float)
        return self._law(points, [keys[i] for i in kept], signals)

    def _law(self, points: Sequence[PointTemplates], keys: Sequence[TemplateKey], signals: FloatArray) -> AverageLaw:
        """Return the law of templates (templates, 1 + r + h, n), with the facts of the first point that has each."""
        places = [(point, template_keys(point)) for point in points]
        firsts = [next((point, place[key]) for point, place in places if key in place) for key in keys]
        phases = np.array([point.phases[i] for point, i in firsts])
        last = signals.shape[1] - phases.shape[1]
        size = points[0].index_error
        response = signals[:, 1:last].transpose(0, 2, 1)
        return AverageLaw(
            teeth=points[0].teeth,
            keys=tuple(keys),
            healthy=np.array([point.healthy[i] for point, i in firsts]),
            severity=np.array([point.severity[i] for point, i in firsts]),
            signal=signals[:, 0],
            response=response / size if size else response,
            harmonic=signals[:, last:].transpose(0, 2, 1),
            phases=phases,
            quantities=self._bank.quantities,
        )

    def has_continuous_severity(self, teeth: int) -> bool:
        """Return whether the templates of a tooth count hold between their severities."""
        return self._bank.has_continuous_severity(teeth)

    def share(self, teeth: int, keys: Sequence[DamageKey]) -> FloatArray:
        """Return the share (keys,) of each template among the rows of its kind, the mean over the points."""
        points = [point for point in self._bank.points if point.teeth == teeth]
        shares = np.zeros(len(keys))
        for point in points:
            place: dict[DamageKey, int] = dict(template_keys(point).items())
            shares += [point.share[place[key]] if key in place else 0.0 for key in keys]
        healthy = np.array([key[0] for key in keys])
        for kind in (healthy, ~healthy):
            shares[kind] /= shares[kind].sum()
        return shares
