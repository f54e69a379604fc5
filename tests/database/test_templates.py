"""Unit: a template's row, its only writer and its only reader."""

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_array_equal

import sigdb
from sigdb.core import InputError, NotApplicableError
from sigdb.database import Template, mate_teeth, stored_templates
from sigdb.transmission import Transmission

TEXT = """
[sweep]
rig = "nasa-spiral-bevel"

[[sweep.grid]]
tooth = 1
stiffness_loss = 0.2
pinion.unbalance = 1e-4

[[sweep.grid]]
tooth = 1
stiffness_loss = 0.2
gear.teeth = 35
averages = 35

[[sweep.grid]]
tooth = 1
stiffness_loss = 0.5
phase_shift_deg = 4.5
operating.torque = 100.0

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical", "pinion-housing-vertical"]
"""


@pytest.fixture(scope="module")
def database(make):
    return sigdb.open(make(TEXT))


@pytest.fixture(scope="module")
def stored(database):
    return database.dataset("templates").to_table()


def rows_of(table):
    return [{name: table[name][i] for name in table.column_names} for i in range(table.num_rows)]


def test_rows_read_and_written_again_are_the_same_bits(database, stored):
    """With harmonic excitations and without, two sensors, a swept mate, and a loss of contact."""
    templates = [Template.from_row(row, database.sensors) for row in rows_of(stored)]
    assert {template.contact_loss for template in templates} == {True, False}
    assert {len(template.orders) for template in templates} == {0, 1}
    again = pa.Table.from_pylist([template.to_row(database.sensors) for template in templates], schema=stored.schema)
    assert again.equals(stored.combine_chunks(), check_metadata=True)


def test_shapes_are_those_of_the_sensors_samples_teeth_and_orders(database, stored):
    row = next(row for row in rows_of(stored) if len(row["orders"].as_py()))
    template = Template.from_row(row, database.sensors)
    N = len(row["compression"].as_py())
    assert template.signals.shape == (2, 12 * 32)
    assert template.specimen_response.shape == (2, 12 * 32, 12)
    assert template.harmonic_response.shape == (2, 12 * 32, 1, 2)
    assert (template.compression_response.shape, template.compression_harmonic.shape) == ((N, 12), (N, 1, 2))
    assert_array_equal(template.signals[1], row["tsa__pinion-housing-vertical"].as_py())
    assert_array_equal(template.specimen_response[0].ravel(), row["specimen_response"].as_py())


def test_compressions_are_fractions_of_the_static_one(database, stored):
    row = rows_of(stored)[0]
    template, static = Template.from_row(row, database.sensors), row["static_compression"].as_py()
    assert_array_equal(template.relative_compression, np.array(row["compression"].as_py()) / static)
    assert template.relative_compression.min() == pytest.approx(template.min_compression, rel=0.05)
    assert_array_equal(template.relative_compression_response, template.compression_response / static)


def test_one_sensor_may_be_read_alone(database, stored):
    template = Template.from_row(rows_of(stored)[0], database.sensors, only=["pinion-housing-vertical"])
    whole = Template.from_row(rows_of(stored)[0], database.sensors)
    assert_array_equal(template.signals, whole.signals[1:])
    assert_array_equal(template.reference_variance, whole.reference_variance[1:])


def test_a_template_without_a_result_has_a_status_and_its_case(database, stored):
    case = Template.from_row(rows_of(stored)[0], database.sensors).case
    made = Template(case=case, status="no result; change the rig", status_code="not_applicable")
    row = made.to_row(database.sensors)
    table = pa.Table.from_pylist([row], schema=stored.schema)
    assert {name for name in table.column_names if table[name].null_count == 0} == {
        "status",
        "status_code",
        *(name for name, value in case.items() if value is not None),
    }
    back = Template.from_row(rows_of(table)[0], database.sensors)
    assert (back.case, back.status, back.status_code) == (case, "no result; change the rig", "not_applicable")
    assert back.contact_loss is None
    assert Template.from_row(rows_of(table.drop_columns("status_code"))[0], database.sensors).status_code is None
    assert np.isnan([back.min_compression, back.static_compression, back.error]).all()
    assert (back.signals.size, back.compression.size) == (0, 0)


def test_templates_of_an_operating_point_have_results_and_keep_contact(database):
    templates = stored_templates(database, speed_rpm=14400.0, torque=356.05, teeth=12, sensor="pinion-housing-vertical")
    assert {template.signals.shape[0] for template in templates} == {1}
    assert sorted({mate_teeth(database, template) for template in templates}) == [35, 36]
    with pytest.raises(InputError, match=r"no template at .* torque = 401"):
        stored_templates(database, speed_rpm=14400.0, torque=401.0, teeth=12)


def test_a_rig_that_does_not_turn_exactly_has_no_law(database, monkeypatch):
    monkeypatch.setattr(Transmission, "turns_exactly", lambda self, gear: False)
    with pytest.raises(NotApplicableError, match="templates that are turned are those of rigs with one mesh"):
        stored_templates(database, speed_rpm=14400.0, torque=356.05, teeth=12)
