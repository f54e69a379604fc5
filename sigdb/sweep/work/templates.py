"""Templates: each distinct case simulated once; with the damage at tooth 1 where a turn is exact."""

import time
from collections.abc import Container, Sequence
from itertools import groupby
from typing import Any

import numpy as np
import pyarrow as pa

from sigdb.core import FloatArray, SigdbError
from sigdb.database import Receipt, Store, suffixed, write_part
from sigdb.dynamics import PeriodicRig, SteadyState, Transient, prepare, settle, stable_multiplier
from sigdb.sweep.plan.plan import Plan, RigPoint, TemplateCase, plan_schema
from sigdb.transmission import Damage

_STEPS = 16
"""Steps of the march for each sample that is stored."""


def make_template_part(plan: Plan, store: Store, part: int) -> Receipt:
    """Simulate the templates of a part and write them; failed ones are rows whose status says why."""
    started = time.perf_counter()
    numbers = plan.template_range(part)
    pieces = [{"templates": template_table(plan, part, numbers)}]
    return write_part(store, "templates", part, pieces, plan=plan.hash, first=numbers.start, started=started)


def template_table(plan: Plan, part: int, numbers: Container[int]) -> pa.Table:
    """The table ``templates`` of some templates of a part, simulated."""
    rows = []
    for rig_point, some in groupby(plan.template_range(part), key=lambda number: plan.case(number).rig_point):
        cases = {number: plan.case(number) for number in some}
        if wanted := [number for number in cases if number in numbers]:
            prepared = _prepare(plan, rig_point, [case.damage for case in cases.values()])
            rows += [_template_row(plan, number, cases[number], prepared) for number in wanted]
    return pa.Table.from_pylist(rows, schema=plan_schema(plan).arrow("templates"))


class _Prepared:
    """A rig point ready for some templates: the factored healthy rig, its stability and reference variances.

    Stability is judged healthy and with the softest mesh of these templates: those of a rig point within one part.
    """

    def __init__(self, plan: Plan, number: int, damages: Sequence[Damage]) -> None:
        point: RigPoint = plan.rig_points[number]
        self.rig: PeriodicRig = prepare(point.rig, gear=plan.gear, samples_per_tooth=plan.signature.samples_per_tooth)
        healthy = self.rig.steady_state({})
        softest = min((self.rig.mesh_stiffness(damage.on_teeth(point.teeth)) for damage in damages), key=np.sum)
        self.floquet_multiplier = max(
            stable_multiplier(point.rig, self.rig, stiffness) for stiffness in (healthy.mesh_stiffness, softest)
        )
        self.reference_variance = dict(
            zip(
                point.rig.sensors,
                (healthy.signals + healthy.harmonic_response[..., 0].sum(axis=2)).var(axis=1),
                strict=True,
            )
        )


def _prepare(plan: Plan, number: int, damages: Sequence[Damage]) -> _Prepared | str:
    """The prepared rig point, or the sentence that says why there is none."""
    try:
        return _Prepared(plan, number, damages)
    except SigdbError as error:
        return str(error)


def _template_row(plan: Plan, number: int, case: TemplateCase, prepared: _Prepared | str) -> dict[str, Any]:
    row = {"template": number, "status": "ok", "tooth": case.damage.tooth, **plan.case_columns(number)}
    if isinstance(prepared, str):
        return row | {"status": prepared}
    state = prepared.rig.steady_state(case.damage.on_teeth(prepared.rig.teeth))
    row |= {
        "floquet_multiplier": prepared.floquet_multiplier,
        "static_compression": state.static_compression,
        "min_compression": state.min_compression,
        "least_elsewhere": state.least_elsewhere,
        "contact_loss": state.min_compression < 0,
    }
    if state.min_compression < 0:
        return row | _marched(plan, prepared, case)
    return row | _arrays(plan, prepared, state)


def _marched(plan: Plan, prepared: _Prepared, case: TemplateCase) -> dict[str, Any]:
    """Columns of a case that loses contact: its motion with backlash, for gears without index errors."""
    damage, none = case.damage.on_teeth(prepared.rig.teeth), np.zeros(prepared.rig.teeth)
    solver = Transient(
        samples_per_tooth=plan.signature.samples_per_tooth, steps_per_tooth=_STEPS * plan.signature.samples_per_tooth
    )
    try:
        orbit = settle(
            plan.rig_points[case.rig_point].rig,
            gear=prepared.rig.gear,
            damage=damage,
            index_errors=none,
            state=prepared.rig.modal_state(damage, none),
            solver=solver,
            system=prepared.rig.system,
        )
    except SigdbError as error:
        return {"status": str(error)}
    return {
        "error": orbit.error,
        "min_compression": orbit.min_compression,
        "compression": _list(orbit.compression[0]),
        "mesh_force": _list(orbit.mesh_force[0]),
        "orders": [one.order for one in prepared.rig.harmonics],
        **_of_sensors(plan, prepared, tsa=orbit.signals),
    }


def contact_loss_sentence(min_compression: float) -> str:
    """Status of a row whose specimen takes a mesh out of contact that its template keeps in."""
    return (
        f"with this specimen the mesh loses contact (least compression {min_compression:.3f} of the static one), where "
        "the linear solution does not hold; reduce the damage or the index errors, or raise the torque"
    )


def _arrays(plan: Plan, prepared: _Prepared, state: SteadyState) -> dict[str, Any]:
    return {
        "error": state.error,
        "compression": _list(state.compression),
        "compression_response": _list(state.compression_response),
        "compression_harmonic": _list(state.compression_harmonic),
        "mesh_force": _list(state.mesh_force),
        "orders": list(state.orders),
        **_of_sensors(
            plan,
            prepared,
            tsa=state.signals,
            specimen_response=state.specimen_response,
            harmonic_response=state.harmonic_response,
        ),
    }


def _of_sensors(plan: Plan, prepared: _Prepared, **arrays: FloatArray) -> dict[str, Any]:
    """Columns of the stored sensors of arrays (sensors of the rig, ...)."""
    at = {name: i for i, name in enumerate(plan.rig.sensors)}
    columns: dict[str, Any] = {}
    for sensor in plan.sensors:
        columns[suffixed("reference_variance", plan.sensors, sensor)] = prepared.reference_variance[sensor]
        for name, values in arrays.items():
            columns[suffixed(name, plan.sensors, sensor)] = _list(values[at[sensor]])
    return columns


def _list(values: FloatArray) -> FloatArray:
    return values.astype(np.float32).ravel()
