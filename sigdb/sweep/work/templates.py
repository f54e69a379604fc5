"""Templates: each distinct case simulated once; with the damage at tooth 1 where a turn is exact."""

import time
from collections.abc import Container, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
import pyarrow as pa

from sigdb.core import SigdbError
from sigdb.database import Receipt, Schema, Store, Template, read_schema, write_part
from sigdb.dynamics import PeriodicRig, Transient, prepare, settle, stable_multiplier
from sigdb.sweep.plan.plan import Plan, RigPoint, TemplateCase
from sigdb.transmission import Damage

_STEPS = 16
"""Steps of the march for each sample that is stored."""


def make_template_part(plan: Plan, store: Store, part: int) -> Receipt:
    """Simulate the templates of a part and write them; failed ones are rows whose status says why."""
    started = time.perf_counter()
    numbers = plan.template_range(part)
    pieces = [{"templates": template_table(plan, read_schema(store), part, numbers)}]
    return write_part(store, "templates", part, pieces, plan=plan.hash, first=numbers.start, started=started)


def template_table(plan: Plan, schema: Schema, part: int, numbers: Container[int]) -> pa.Table:
    """Simulate some templates of a part and return them as the table ``templates``, with the columns of ``schema``."""
    rows = []
    for rig_point, some in groupby(plan.template_range(part), key=lambda number: plan.case(number).rig_point):
        cases = {number: plan.case(number) for number in some}
        if wanted := [number for number in cases if number in numbers]:
            prepared = _prepare(plan, rig_point, [case.damage for case in cases.values()])
            rows += [_template(plan, number, cases[number], prepared).to_row(plan.sensors) for number in wanted]
    return pa.Table.from_pylist(rows, schema=schema.arrow("templates"))


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
        self.reference_variance = (healthy.signals + healthy.harmonic_response[..., 0].sum(axis=2)).var(axis=1)


def _prepare(plan: Plan, number: int, damages: Sequence[Damage]) -> _Prepared | str:
    """The prepared rig point, or the sentence that says why there is none."""
    try:
        return _Prepared(plan, number, damages)
    except SigdbError as error:
        return str(error)


def _template(plan: Plan, number: int, case: TemplateCase, prepared: _Prepared | str) -> Template:
    columns = {"template": number, "tooth": case.damage.tooth, **plan.case_columns(number)}
    if isinstance(prepared, str):
        return Template(case=columns, status=prepared)
    state = prepared.rig.steady_state(case.damage.on_teeth(prepared.rig.teeth))
    at = _stored_places(plan)
    template = Template(
        case=columns,
        contact_loss=state.min_compression < 0,
        floquet_multiplier=prepared.floquet_multiplier,
        static_compression=state.static_compression,
        min_compression=state.min_compression,
        least_elsewhere=state.least_elsewhere,
        error=state.error,
        compression=state.compression,
        compression_response=state.compression_response,
        compression_harmonic=state.compression_harmonic,
        mesh_force=state.mesh_force,
        orders=np.array(state.orders, float),
        reference_variance=prepared.reference_variance[at],
        signals=state.signals[at],
        specimen_response=state.specimen_response[at],
        harmonic_response=state.harmonic_response[at],
    )
    return _marched(plan, prepared, case, template) if template.contact_loss else template


def _marched(plan: Plan, prepared: _Prepared, case: TemplateCase, template: Template) -> Template:
    """A template that loses contact: its motion with backlash, for gears without index errors."""
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
        return replace(template, status=str(error), error=np.nan)
    return replace(
        template,
        error=orbit.error,
        min_compression=orbit.min_compression,
        compression=orbit.compression[0],
        compression_response=np.zeros_like(template.compression_response),
        compression_harmonic=np.zeros_like(template.compression_harmonic),
        mesh_force=orbit.mesh_force[0],
        signals=orbit.signals[_stored_places(plan)],
        specimen_response=np.zeros_like(template.specimen_response),
        harmonic_response=np.zeros_like(template.harmonic_response),
    )


def _stored_places(plan: Plan) -> list[int]:
    """Places of the stored sensors among those of the rig."""
    return [list(plan.rig.sensors).index(sensor) for sensor in plan.sensors]


def contact_loss_sentence(min_compression: float) -> str:
    """Status of a row whose specimen takes a mesh out of contact that its template keeps in."""
    return (
        f"with this specimen the mesh loses contact (least compression {min_compression:.3f} of the static one), where "
        "the linear solution does not hold; reduce the damage or the index errors, or raise the torque"
    )
