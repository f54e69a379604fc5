"""The picture of a view: prepared rigs are kept, so that a change of the damage takes a few milliseconds."""

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from sigdb.core import FloatArray, InputError, specimen_stream
from sigdb.dynamics import Periodic, PreparedRig, SteadyState, damaged_gear, prepare, superpose
from sigdb.explorer.panels import average_panels
from sigdb.explorer.view import View
from sigdb.measurement import index_errors, noise_deviation
from sigdb.signature import INDICATORS, indicators
from sigdb.transmission import Damage, Transmission, tooth_stiffness

SEED = 1
"""Seed of the specimens and of the noise, as ``seed = 1`` of a recipe."""
SAMPLES_PER_TOOTH = 64
"""Samples of an average in a tooth pass."""


T = TypeVar("T")


class Kept(Generic[T]):
    """The last things that were made, by key.

    Parameters
    ----------
    most : int
        Their number at most.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._things: OrderedDict[object, T] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: object, make: Callable[[], T]) -> T:
        """Return the thing of a key, made if it is not kept."""
        with self._lock:
            if key not in self._things:
                self._things[key] = make()
                while len(self._things) > self._most:
                    self._things.popitem(last=False)
            self._things.move_to_end(key)
            return self._things[key]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A picture of an average, as facts and arrays.

    Attributes
    ----------
    facts
        Numbers and words by name.
    arrays
        Arrays by name.
    """

    facts: dict[str, Any]
    arrays: dict[str, FloatArray]


@dataclass(frozen=True, kw_only=True)
class Simulated:
    """A case at one torque.

    Attributes
    ----------
    signals
        (sensors, n) clean averages.
    forces
        (meshes, N) force of each mesh over its static one at the rig's own torque.
    compression
        (N,) compression of the gear's mesh over its static one; index errors of the teeth are not subtracted.
    """

    signals: FloatArray
    forces: FloatArray
    compression: FloatArray


class LiveRig:
    """A rig whose views are simulated while a person waits.

    Parameters
    ----------
    rig : Transmission
        The rig.
    gear : str, optional
        The damaged gear; the driving gear of the first mesh if left out.
    """

    def __init__(self, rig: Transmission, gear: str | None = None) -> None:
        self.rig, self.gear = rig, damaged_gear(rig, gear)
        self._built: Kept[Transmission] = Kept(32)
        self._prepared: Kept[PreparedRig] = Kept(12)
        self._states: Kept[SteadyState] = Kept(32)

    @property
    def teeth(self) -> int:
        """Tooth count of the gear as the rig has it."""
        return self.rig.gears[self.gear].teeth

    def built(self, view: View) -> Transmission:
        """Return the rig of a view, at the rig's own torque."""
        changes = view.changes(self.rig, self.gear)
        return self._built.get(tuple(changes.items()), lambda: self.rig.replace(changes)) if changes else self.rig

    def floquet_multiplier(self, view: View) -> float:
        """Return the largest Floquet multiplier of the linear rig of a view, which is unstable from 1.

        It takes longer than a picture, and nothing else depends on it: a page asks for it once its settings rest.
        """
        prepared = self._prepare(self.built(view), 1.0).prepared
        return prepared.floquet_multiplier([view.damage.on_teeth(prepared.teeth)])

    def errors_of(self, view: View, rig: Transmission) -> FloatArray:
        """Return the (teeth,) index errors of the specimen of a view, m."""
        teeth, mate = (rig.gears[name].teeth for name in (self.gear, rig.mate(self.gear)))
        return view.index_error * index_errors(specimen_stream(SEED, view.specimen), teeth, mate)

    def show(self, view: View) -> Shown:
        """Return what the page draws of a view.

        Raises
        ------
        SigdbError
            If the view cannot be simulated.
        """
        started = time.perf_counter()
        rig, (sensor, number) = self.built(view), self.sensor(view)
        teeth = rig.gears[self.gear].teeth
        errors = self.errors_of(view, rig)
        healthy, damaged = (self._case(rig, view, damage, errors) for damage in (Damage(), view.damage))
        solved = time.perf_counter()
        noise = self._noise(rig, view, number)
        tsa, reference = damaged.signals[number] + noise, healthy.signals[number] + noise
        unit, least = rig.sensors[sensor].unit, float(damaged.forces.min())
        arrays = average_panels(tsa, teeth, reference)
        arrays |= {"stiffness": self._stiffness(rig, view.damage), "stiffness_healthy": self._stiffness(rig, Damage())}
        values = indicators(np.stack([tsa, reference]), teeth=teeth)
        computed = time.perf_counter()
        facts = {
            "teeth": teeth,
            "damaged": sorted(view.damage.on_teeth(teeth)),
            "sensor": sensor,
            "unit": unit,
            "indicators": [
                {
                    "name": name,
                    "help": INDICATORS[name].help,
                    "unit": INDICATORS[name].unit.replace("signal", unit),
                    "value": float(value),
                    "healthy": float(healthy_value),
                }
                for name, (value, healthy_value) in values.items()
            ],
            "least_force": least,
            "least_compression": float(damaged.compression.min()),
            "contact": least > 0,
            "milliseconds": {"simulation": 1e3 * (solved - started), "signature": 1e3 * (computed - solved)},
        }
        return Shown(facts=facts, arrays=arrays)

    def sensor(self, view: View) -> tuple[str, int]:
        """Return the sensor of a view and its number."""
        sensors = list(self.rig.sensors)
        if view.sensor is not None and view.sensor not in sensors:
            raise InputError(f"sensor {view.sensor!r} is not in the rig; it has {', '.join(sensors)}")
        sensor = view.sensor or sensors[0]
        return sensor, sensors.index(sensor)

    def _noise(self, rig: Transmission, view: View, number: int) -> FloatArray | float:
        """Return the noise of the average of a sensor; 0 without a signal-to-noise ratio."""
        if view.snr_db is None:
            return 0.0
        nominal = self._case(rig, view, Damage(), None).signals[number]
        deviation = float(noise_deviation(np.var(nominal), np.array(view.snr_db))) / np.sqrt(view.averages)
        return np.asarray(deviation * np.random.default_rng(SEED).standard_normal(len(nominal)))

    def _stiffness(self, rig: Transmission, damage: Damage) -> FloatArray:
        mesh = rig.meshes[rig.meshes_of(self.gear)[0]]
        teeth = rig.gears[self.gear].teeth
        u = np.arange(SAMPLES_PER_TOOTH * teeth) / SAMPLES_PER_TOOTH
        driving = mesh.driving == self.gear
        return np.asarray(tooth_stiffness(mesh, teeth, u, damage.on_teeth(teeth), driving=driving).sum(axis=0))

    def _case(self, rig: Transmission, view: View, damage: Damage, errors: FloatArray | None) -> Simulated:
        """Return a case at the torque of the view.

        The linear rig is affine in its torque, so two torques give all others.
        """
        once, ratio = self._solve(rig, damage, errors, 1.0), self._torque_ratio(view)
        if ratio == 1:
            return once
        double = self._solve(rig, damage, errors, 2.0)
        return Simulated(
            signals=once.signals + (ratio - 1) * (double.signals - once.signals),
            forces=(once.forces + (ratio - 1) * (double.forces - once.forces)) / ratio,
            compression=(once.compression + (ratio - 1) * (double.compression - once.compression)) / ratio,
        )

    def _torque_ratio(self, view: View) -> float:
        return 1.0 if view.torque is None else view.torque / self.rig.operating.torque

    def _solve(self, rig: Transmission, damage: Damage, errors: FloatArray | None, ratio: float) -> Simulated:
        """Return a case at a multiple of the rig's torque, with forces over the static ones at the rig's own."""
        state = self._state(rig, damage, ratio)
        force = state.mesh_force_at(errors) / state.static_force
        others = superpose(
            state.force_elsewhere, state.force_elsewhere_response, state.force_elsewhere_harmonic, errors
        )
        return Simulated(
            signals=state.signals_at(errors),
            forces=ratio * np.concatenate([force[None], others]),
            compression=ratio * state.compression_at(errors) / state.static_compression,
        )

    def _state(self, rig: Transmission, damage: Damage, ratio: float) -> SteadyState:
        """Return the steady state of a case, kept for other specimens and torques."""
        prepared = self._prepare(rig, ratio).prepared
        teeth = damage.on_teeth(prepared.teeth)
        key = (*_build(rig, self.gear), ratio, repr(teeth))
        return self._states.get(key, lambda: prepared.steady_state([teeth])[0])

    def _prepare(self, rig: Transmission, ratio: float) -> PreparedRig:
        """Return a prepared rig, kept from before where it can be."""

        def make() -> PreparedRig:
            changed = rig if ratio == 1 else rig.replace({"operating.torque": ratio * rig.operating.torque})
            return prepare(changed, self.gear, solver=Periodic(samples_per_tooth=SAMPLES_PER_TOOTH))

        return self._prepared.get((*_build(rig, self.gear), ratio), make)


def _build(rig: Transmission, gear: str) -> tuple[float, ...]:
    """Return the numbers of a rig that a view may change."""
    return rig.gears[gear].teeth, rig.operating.speed_rpm
