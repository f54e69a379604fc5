"""The smallest damage of a rig that each of several measurements would show."""

from collections.abc import Iterator
from os import PathLike

import numpy as np
import pandas as pd

from sigdb.core import InputError, NotApplicableError, Note, OnProgress, Progress, ignore, suggestion, validated
from sigdb.measurement import noise_deviation, tooth_cycle
from sigdb.planning.candidate_averages import CandidateAverages
from sigdb.planning.measurement_plan import MeasurementPlan
from sigdb.planning.settings import PlanSettings
from sigdb.planning.smallest_damage import SmallestDamage
from sigdb.recognition import Hypotheses
from sigdb.transmission import Transmission, as_transmission

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_MOST = 20_000
"""Most measurements of a plan."""
_USUAL_AVERAGES = (30, 300)


def plan_measurement(
    rig: Transmission | str | PathLike[str],
    settings: PlanSettings | None = None,
    *,
    on_progress: OnProgress = ignore,
) -> MeasurementPlan:
    """Return the smallest damage that each measurement of a rig would show.

    Every combination of sensor, speed, torque and number of averages is a measurement. Its average follows the law of
    a database's rows: the simulated signal, white noise of one revolution over the number of averages, and index
    errors that are not known. The size that is found with probability 0.9, a90, is that of the likelihood ratio, so
    that no rule finds a smaller one.

    Parameters
    ----------
    rig : Transmission, str or path-like
        A rig with one mesh, its name or its file.
    settings : PlanSettings, optional
        Damage, measurements and noise; the defaults if left out.
    on_progress : callable, optional
        Called with the number of finished operating points.

    Returns
    -------
    MeasurementPlan

    Raises
    ------
    NotApplicableError
        If the rig has several meshes, for which the law of an average is not computed.
    InputError
        If a name is not known, averages are not whole tooth cycles, or the rig has no law at an operating point.

    Examples
    --------
    >>> from sigdb.planning import PlanSettings, plan_measurement
    >>> point = {"speeds_rpm": [14400.0], "torques": [356.0], "averages": [102], "draws": 200}
    >>> plan = plan_measurement("nasa-spiral-bevel", PlanSettings(snr_db=10.0, index_error=0.0, **point))
    >>> [name for name in plan.table["sensor"]]
    ['pinion-housing-vertical', 'pinion-vertical']
    """
    settings = settings or PlanSettings()
    rig = _with_sensors(as_transmission(rig), settings)
    gear = _gear(rig, settings)
    averages = _averages(rig, gear, settings)
    points = [(speed, torque) for speed in settings.speeds(rig) for torque in settings.torques_of(rig)]
    count = len(points) * len(averages) * len(rig.sensors)
    if count > _MOST:
        raise InputError(f"the plan has {count} measurements, and the limit is {_MOST}; give fewer values")
    noise = _noise(rig, gear, settings)
    rows: list[dict[str, object]] = []
    opening = 0
    for done, (speed, torque) in enumerate(points):
        on_progress(Progress(stage="operating points", done=done, total=len(points), before=0))
        at = rig.replace({"operating.speed_rpm": speed, "operating.torque": torque})
        candidates = CandidateAverages.of(at, gear, settings)
        opening += candidates.opens
        rows += _rows(at, gear, candidates, noise, averages, settings)
    on_progress(Progress(stage="operating points", done=len(points), total=len(points), before=0))
    table = pd.DataFrame(rows).sort_values("a90", kind="stable").reset_index(drop=True)
    notes = (*_noise_notes(rig, settings), *_opening_notes(opening, len(points)))
    return MeasurementPlan(rig=rig.name, gear=gear, unit=settings.unit, settings=settings, table=table, notes=notes)


def _with_sensors(rig: Transmission, settings: PlanSettings) -> Transmission:
    """Return the rig with the requested sensors, along each axis where that is requested."""
    for name in (*settings.sensors, *settings.noise):
        if name not in rig.sensors:
            raise InputError(f"sensor {name!r} is not in rig {rig.name}{suggestion(name, rig.sensors)}")
    names = settings.sensors or tuple(rig.sensors)
    if not names:
        raise InputError(f"rig {rig.name} has no sensor; add one to its file")
    data = rig.model_dump(mode="json", exclude_none=True)
    sensors = {name: data["sensors"][name] for name in names}
    if settings.directions == "axes":
        sensors = {
            f"{name}-{axis}": sensor | {"direction": direction}
            for name, sensor in sensors.items()
            for axis, direction in _AXES.items()
        }
    return validated(Transmission, data | {"sensors": sensors}, owner=f"rig {rig.name}")


def _gear(rig: Transmission, settings: PlanSettings) -> str:
    """Return the damaged gear, whose damage at another tooth is a turn."""
    if settings.gear is not None and settings.gear not in rig.gears:
        raise InputError(f"gear {settings.gear!r} is not in rig {rig.name}{suggestion(settings.gear, rig.gears)}")
    gear = settings.gear or (next(iter(rig.meshes.values())).driving if rig.meshes else None)
    if gear is None or not rig.turns_exactly(gear):
        raise NotApplicableError(
            f"rig {rig.name} has {len(rig.meshes)} meshes; the law of an average is known for rigs with one: describe "
            "the gear pair of interest as a rig of its own"
        )
    return gear


def _averages(rig: Transmission, gear: str, settings: PlanSettings) -> tuple[int, ...]:
    """Return the numbers of averages, which are whole tooth cycles: then the mate's index errors leave a known mean."""
    cycle = tooth_cycle(rig.gears[gear].teeth, rig.gears[rig.mate(gear)].teeth)
    for count in settings.averages:
        if count % cycle:
            below, above = count // cycle * cycle, -(-count // cycle) * cycle
            nearest = f"{below} or {above}" if below else str(above)
            raise InputError(
                f"averages = {count} is no whole number of tooth cycles of {cycle} revolutions; give {nearest}"
            )
    return settings.averages or tuple(dict.fromkeys(max(cycle, round(n / cycle) * cycle) for n in _USUAL_AVERAGES))


def _noise(rig: Transmission, gear: str, settings: PlanSettings) -> dict[str, float]:
    """Return the noise of one revolution by sensor; that of a unit's greatest signal where none is stated."""
    laws = CandidateAverages.of(rig, gear, settings).by_sensor
    variance = {sensor: float(law.reference_variance[0]) for sensor, law in laws.items()}
    noise = {}
    for name, sensor in rig.sensors.items():
        greatest = max(variance[other] for other, each in rig.sensors.items() if each.unit == sensor.unit)
        assumed = float(noise_deviation(np.array(greatest), np.array(settings.snr_db or 0.0)))
        noise[name] = next((value for stated, value in settings.noise.items() if _is_of(name, stated)), assumed)
    return noise


def _is_of(name: str, stated: str) -> bool:
    """Return whether a sensor is the stated one, or that along an axis."""
    return name == stated or name in [f"{stated}-{axis}" for axis in _AXES]


def _noise_notes(rig: Transmission, settings: PlanSettings) -> list[Note]:
    """Return a note where the noise of a sensor is assumed."""
    assumed = [name for name in rig.sensors if not any(_is_of(name, stated) for stated in settings.noise)]
    if not assumed or settings.snr_db is not None:
        return []
    text = (
        f"The noise of {len(assumed)} sensors is assumed: at the rig's own operating point one revolution has as much "
        f"noise as signal, by the greatest signal of a unit. The interval has a doubt of {settings.doubt_db:g} dB."
    )
    return [Note(code="noise-assumed", text=text, values={"sensors": ", ".join(assumed)})]


def _opening_notes(opening: int, points: int) -> list[Note]:
    """Return a note where larger sizes open a mesh."""
    if not opening:
        return []
    text = (
        f"At {opening} of {points} operating points a size above the largest in the table opens a mesh. Its average "
        "differs more, but its law is not known."
    )
    return [Note(code="mesh-opens", text=text, values={"points": opening})]


def _rows(
    rig: Transmission,
    gear: str,
    candidates: CandidateAverages,
    noise: dict[str, float],
    averages: tuple[int, ...],
    settings: PlanSettings,
) -> Iterator[dict[str, object]]:
    """Yield the rows of an operating point."""
    rpm = abs(rig.speed(rig.gears[gear].shaft)) * 60 / (2 * np.pi)
    for sensor, laws in candidates.by_sensor.items():
        stated = any(_is_of(sensor, name) for name in settings.noise)
        doubt = (settings.noise_doubt_db or 0.0) if stated else settings.doubt_db
        for count in averages:
            deviation = noise[sensor] / np.sqrt(count)
            middle, low, high = (
                _a90(laws, candidates.sizes, deviation * 10 ** (change / 20), settings)
                for change in (0.0, -doubt, doubt)
            )
            yield {
                "sensor": sensor,
                "direction": " ".join(f"{part:.3g}" for part in rig.sensors[sensor].direction),
                "speed_rpm": rig.operating.speed_rpm,
                "torque": rig.operating.torque,
                "averages": count,
                "seconds": count * 60 / rpm,
                "noise": noise[sensor],
                "signal_unit": rig.sensors[sensor].unit,
                "noise_from": "stated" if stated or settings.snr_db is not None else "assumed",
                "a90": middle,
                "a90_low": low,
                "a90_high": high,
                "largest": float(candidates.sizes[-1]),
            }


def _a90(laws: Hypotheses, sizes: np.ndarray, noise: float, settings: PlanSettings) -> float:
    """Return the a90 of one measurement."""
    return SmallestDamage(
        hypotheses=laws,
        sizes=sizes,
        tooth_known=settings.tooth == "known",
        noise=noise,
        index_error=settings.index_error,
        rate=settings.false_alarm_rate,
        draws=settings.draws,
        seed=settings.seed,
    ).a90
