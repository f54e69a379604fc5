"""Templates: each distinct case simulated once; with the damage at tooth 1 where a turn is exact."""

import time
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby, islice

import numpy as np
import pyarrow as pa

from sigdb.core import SigdbError
from sigdb.database import CaseValue, Receipt, Schema, Store, Template, read_schema, write_part
from sigdb.dynamics import Prepared, SteadyState
from sigdb.sweep.plan.plan import Plan, RigPoint, TemplateCase
from sigdb.transmission import Damage

_CASES_AT_ONCE = 8
"""Cases solved together: their responses are in memory at once."""


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
        if wanted := {number: case for number, case in cases.items() if number in numbers}:
            prepared = _prepare(plan, rig_point, [case.damage for case in cases.values()])
            rows += [template.to_row(plan.sensors) for template in _templates(plan, wanted, prepared)]
    return pa.Table.from_pylist(rows, schema=schema.arrow("templates"))


class _PreparedPoint:
    """A rig point ready for some templates: prepared by the solver, with its stability and reference variances.

    Stability is assessed healthy and with the softest mesh of these templates: those of a rig point within one part.
    """

    def __init__(self, plan: Plan, number: int, damages: Sequence[Damage]) -> None:
        point: RigPoint = plan.rig_points[number]
        self.prepared: Prepared = plan.solver.prepare(point.rig, plan.gear)
        on_teeth = [damage.on_teeth(point.teeth) for damage in damages]
        healthy = self.prepared.floquet_multiplier([{}])
        self.floquet_multiplier = max(healthy, self.prepared.floquet_multiplier(on_teeth))
        self.reference_variance = self.prepared.healthy_signals().var(axis=1)


def _prepare(plan: Plan, number: int, damages: Sequence[Damage]) -> _PreparedPoint | str:
    """The prepared rig point, or the sentence that says why there is none."""
    try:
        return _PreparedPoint(plan, number, damages)
    except SigdbError as error:
        return str(error)


def _templates(plan: Plan, cases: Mapping[int, TemplateCase], point: _PreparedPoint | str) -> Iterator[Template]:
    """The templates of some cases of a rig point, by number."""
    columns = {
        number: {"template": number, "tooth": case.damage.tooth, **plan.case_columns(number)}
        for number, case in cases.items()
    }
    if isinstance(point, str):
        yield from (Template(case=case, status=point) for case in columns.values())
        return
    for numbers in _batches(cases, _CASES_AT_ONCE):
        damages = [cases[number].damage.on_teeth(point.prepared.teeth) for number in numbers]
        states = point.prepared.steady_state(damages)
        yield from (_template(plan, columns[number], point, states, i) for i, number in enumerate(numbers))


def _batches(numbers: Iterable[int], size: int) -> Iterator[list[int]]:
    rest = iter(numbers)
    while batch := list(islice(rest, size)):
        yield batch


def _template(
    plan: Plan, columns: Mapping[str, CaseValue], point: _PreparedPoint, states: SteadyState, i: int
) -> Template:
    """The template of the case i of some steady states."""
    least, lost = float(states.min_compression[i]), bool(states.contact_loss[i])
    template = Template(
        case=columns,
        status=_status(states, i),
        contact_loss=lost,
        floquet_multiplier=point.floquet_multiplier,
        static_compression=states.static_compression,
        min_compression=least,
        least_elsewhere=float(states.least_elsewhere[i]),
    )
    if template.status != "ok":
        return template
    state, at = states[i], [list(plan.rig.sensors).index(sensor) for sensor in plan.sensors]
    return replace(
        template,
        error=float(state.error),
        compression=state.compression,
        compression_response=state.compression_response,
        compression_harmonic=state.compression_harmonic,
        mesh_force=state.mesh_force,
        orders=np.array(state.orders, float),
        reference_variance=point.reference_variance[at],
        signals=state.signals[at],
        specimen_response=state.specimen_response[at],
        harmonic_response=state.harmonic_response[at],
    )


def _status(states: SteadyState, i: int) -> str:
    """``ok``, or why the case i of some steady states makes no template."""
    if (failure := states.failures[i]) is not None:
        return str(failure)
    if states.is_linear[i] and states.contact_loss[i]:
        return (
            f"the mesh loses contact (least compression {states.min_compression[i]:.3f} of the static one), where the "
            "linear solution does not hold; reduce the damage, raise the torque, or leave out sweep.solver"
        )
    if not states.is_linear[i] and not states.parts_contact[i] and states.orders:
        return (
            "unbalance, run-out or a fluctuating load act while every case is marched: the motion with damage at one "
            "tooth is not that at another turned; leave those out, or sweep.solver"
        )
    return "ok"


def contact_loss_sentence(min_compression: float) -> str:
    """Return the status of a row whose specimen takes a mesh out of contact that its template keeps in."""
    return (
        f"with this specimen the mesh loses contact (least compression {min_compression:.3f} of the static one), where "
        "the linear solution does not hold; reduce the damage or the index errors, or raise the torque"
    )
