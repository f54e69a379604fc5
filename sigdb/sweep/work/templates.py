"""Templates of a sweep: each distinct case is simulated once, and read again for its rows.

The damage is at tooth 1 where a turn is exact.
"""

import time
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import groupby, islice

import numpy as np
import pyarrow as pa

from sigdb.core import FloatArray, InputError, SigdbError, UnstableRigError
from sigdb.database import (
    ROW_GROUP,
    CaseValue,
    CheckedParquet,
    Receipt,
    Schema,
    StatusCode,
    Store,
    Template,
    read_receipt,
    read_schema,
    write_part,
)
from sigdb.dynamics import Prepared, Solver, SteadyState
from sigdb.sweep.plan.plan import PART_TEMPLATES, Plan, RigPoint, TemplateCase
from sigdb.sweep.work.nuisance_modes import NuisanceModes
from sigdb.transmission import Damage, Transmission

CASES_AT_ONCE = 8
"""Cases solved together: their responses are in memory at once."""
_FILES_KEPT, _GROUPS_KEPT, _TEMPLATES_KEPT = 4, 2, 16
"""Files, row groups and templates that a reader keeps: rows need templates in order."""


def make_template_part(plan: Plan, store: Store, part: int) -> Receipt:
    """Simulate the templates of a part and write them; a failed case is a row whose status says why."""
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


class HealthyRig:
    """A rig prepared by a solver for damage of a gear, with its stability and variances without damage."""

    def __init__(self, solver: Solver, rig: Transmission, gear: str) -> None:
        self._made_from = solver, rig, gear
        self.prepared: Prepared = solver.prepare(rig, gear)
        self.floquet_multiplier = self.prepared.floquet_multiplier([{}])
        self.reference_variance: FloatArray = self.prepared.healthy_signals().var(axis=1)

    def is_of(self, solver: Solver, rig: Transmission, gear: str) -> bool:
        """Whether it was prepared from equal values."""
        return self._made_from == (solver, rig, gear)


class _HealthyRigs:
    """The healthy rig that was prepared last: the next part, round or check often needs the same."""

    def __init__(self) -> None:
        self._last: HealthyRig | None = None

    def prepared(self, solver: Solver, rig: Transmission, gear: str) -> HealthyRig:
        """Return the healthy rig, prepared unless it is the last one."""
        last = self._last
        if last is None or not last.is_of(solver, rig, gear):
            self._last = last = HealthyRig(solver, rig, gear)
        return last


_healthy_rigs = _HealthyRigs()


class _PreparedPoint:
    """A rig point ready for some templates: prepared by the solver, with its stability and reference variances.

    Stability is assessed healthy and with the softest mesh of these templates: those of a rig point within one part.
    """

    def __init__(self, plan: Plan, number: int, damages: Sequence[Damage]) -> None:
        point: RigPoint = plan.rig_points[number]
        healthy = _healthy_rigs.prepared(plan.solver, point.rig, plan.gear)
        on_teeth = [damage.on_teeth(point.teeth) for damage in damages]
        self.prepared = healthy.prepared
        self.floquet_multiplier = max(healthy.floquet_multiplier, self.prepared.floquet_multiplier(on_teeth))
        self.reference_variance = healthy.reference_variance
        self.nuisances = NuisanceModes(plan, point) if plan.nuisance.exist else None


def _prepare(plan: Plan, number: int, damages: Sequence[Damage]) -> _PreparedPoint | SigdbError:
    """Return the prepared rig point, or the error that says why there is none."""
    try:
        return _PreparedPoint(plan, number, damages)
    except SigdbError as error:
        return error


def _templates(plan: Plan, cases: Mapping[int, TemplateCase], point: _PreparedPoint | SigdbError) -> Iterator[Template]:
    """Yield the templates of some cases of a rig point."""
    columns = {
        number: {"template": number, "tooth": case.damage.tooth, **plan.case_columns(number)}
        for number, case in cases.items()
    }
    if isinstance(point, SigdbError):
        code, reason = _failure(point)
        yield from (Template(case=case, status=reason, status_code=code) for case in columns.values())
        return
    for numbers in _batches(cases, CASES_AT_ONCE):
        damages = [cases[number].damage.on_teeth(point.prepared.teeth) for number in numbers]
        states = point.prepared.steady_state(damages)
        for i, number in enumerate(numbers):
            template = _template(plan, columns[number], point, states, i)
            if point.nuisances is not None and template.status == "ok" and not template.contact_loss:
                modes, counts = point.nuisances.of(damages[i], states[i], template.reference_variance)
                template = replace(template, nuisance_modes=modes, nuisance_counts=counts)
            yield template


def _batches(numbers: Iterable[int], size: int) -> Iterator[list[int]]:
    rest = iter(numbers)
    while batch := list(islice(rest, size)):
        yield batch


def _template(
    plan: Plan, columns: Mapping[str, CaseValue], point: _PreparedPoint, states: SteadyState, i: int
) -> Template:
    """Return the template of case ``i`` of some steady states."""
    code, status = _status(states, i)
    template = Template(
        case=columns,
        status=status,
        status_code=code,
        contact_loss=bool(states.contact_loss[i]),
        floquet_multiplier=point.floquet_multiplier,
        static_compression=states.static_compression,
        min_compression=float(states.min_compression[i]),
        least_elsewhere=float(states.least_elsewhere[i]),
        static_force=states.static_force,
        min_mesh_force=float(states.min_mesh_force[i]),
        least_force_elsewhere=float(states.least_force_elsewhere[i]),
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
        mesh_force_response=state.mesh_force_response,
        mesh_force_harmonic=state.mesh_force_harmonic,
        orders=np.array(state.orders, float),
        reference_variance=point.reference_variance[at],
        signals=state.signals[at],
        specimen_response=state.specimen_response[at],
        harmonic_response=state.harmonic_response[at],
    )


def _status(states: SteadyState, i: int) -> tuple[StatusCode, str]:
    """Return code and status of case ``i`` of some steady states: ``ok``, or why it makes no template."""
    if (failure := states.failures[i]) is not None:
        return _failure(failure)
    if states.is_linear[i] and states.contact_loss[i]:
        return StatusCode.CONTACT, (
            f"the mesh loses contact (least mesh force {states.min_mesh_force[i]:.3f} of the static one), where the "
            "linear solution does not hold; reduce the damage, raise the torque, or leave out sweep.solver"
        )
    if not states.meets_accuracy[i]:
        return StatusCode.NOT_CONVERGED, (
            f"the march in time does not meet its accuracy (error {states.error[i]:.1e} of the peak-to-peak); change "
            "the damage, the speed or the damping"
        )
    if not states.is_linear[i] and not states.parts_contact[i] and states.orders:
        return StatusCode.NOT_TURNED, (
            "unbalance, run-out or a fluctuating load act while every case is marched: the motion with damage at one "
            "tooth is not that at another turned; leave those out, or sweep.solver"
        )
    return StatusCode.OK, "ok"


def _failure(error: SigdbError) -> tuple[StatusCode, str]:
    """Return code and status of a case that cannot be solved."""
    if isinstance(error, UnstableRigError):
        return StatusCode.UNSTABLE, str(error)
    return StatusCode.NOT_APPLICABLE if isinstance(error, InputError) else StatusCode.NOT_CONVERGED, str(error)


class TemplateReader:
    """Reader of the stored templates of a database that is being made, by number."""

    def __init__(self, store: Store, sensors: Sequence[str]) -> None:
        self._store, self._sensors = store, sensors
        self._file = lru_cache(_FILES_KEPT)(self._open)
        self._group = lru_cache(_GROUPS_KEPT)(self._read)
        self._template = lru_cache(_TEMPLATES_KEPT)(self._decode)

    def __getitem__(self, number: int) -> Template:
        return self._template(number)

    def _open(self, part: int) -> CheckedParquet:
        record = read_receipt(self._store, "templates", part).file("templates")
        return CheckedParquet(self._store, record)

    def _read(self, part: int, group: int) -> pa.Table:
        return self._file(part).read([group])

    def _decode(self, number: int) -> Template:
        part, within = divmod(number, PART_TEMPLATES)
        group, place = divmod(within, ROW_GROUP["templates"])
        stored = self._group(part, group).slice(place, 1)
        row = {name: column[0] for name, column in zip(stored.column_names, stored, strict=True)}
        return Template.from_row(row, self._sensors)
