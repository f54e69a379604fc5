"""Unit: options that take a number in their unit, or with a unit of its own."""

import click
import pytest
from click.testing import CliRunner

from sigdb.cli.main import cli
from sigdb.cli.options.quantities import Quantity


@click.command()
@click.option("--speed", type=Quantity("rpm", min=0, min_open=True))
@click.option("--torque", type=Quantity("N m"))
@click.option("--between", type=Quantity("Hz"), nargs=2)
def machine(speed, torque, between):
    click.echo(repr((speed, torque, between)))


@pytest.mark.parametrize(
    ("arguments", "values"),
    [
        ("--speed 1480 --torque -45 --between 1 2e3", (1480.0, -45.0, (1.0, 2000.0))),
        ("--speed 1480rpm --torque 45Nm --between 1Hz 2kHz", (1480.0, 45.0, (1.0, 2000.0))),
        ("--speed 25Hz", (1500.0, None, None)),
    ],
)
def test_numbers_are_in_the_unit_of_the_option(arguments, values):
    assert CliRunner().invoke(machine, arguments.split()).output == f"{values!r}\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--speed", "3 kg"], "Invalid value for '--speed': '3 kg' is a mass; a speed of rotation is needed, such as"),
        (["--speed", "-5 rpm"], "Invalid value for '--speed': -5.0 is not in the range x>0."),
        (["--torque", "much"], "Invalid value for '--torque': 'much' is no number with a unit; a torque is needed"),
    ],
)
def test_another_kind_is_a_wrong_use(arguments, message):
    result = CliRunner().invoke(machine, arguments)
    assert (result.exit_code, result.output.count(message)) == (2, 1)


@pytest.mark.parametrize(
    ("command", "option", "unit"),
    [
        ("describe", "max_hz", "Hz"),
        ("diagnose", "torque", "N m"),
        *((name, "sampling_rate", "Hz") for name in ("signature", "diagnose")),
        *((name, option, "rpm") for name in ("signature", "diagnose") for option in ("speed_rpm", "speed_range_rpm")),
        ("query", "max_seconds", "s"),
    ],
)
def test_physical_options_of_the_commands_take_units(command, option, unit):
    (parameter,) = [one for one in cli.get_command(click.Context(cli), command).params if one.name == option]
    assert isinstance(parameter.type, Quantity)
    assert parameter.type.unit == unit
