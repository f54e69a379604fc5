"""Unit: where the loads of a diagnosis come from: options, then what each recording states."""

import numpy as np
import pytest

from sigdb.core import InputError
from sigdb.diagnosis.machine.machine_recordings import _loads
from sigdb.recording import Channel, Recording

CHANNEL = Channel(name="a1", samples=np.zeros(10), sampling_rate=1000.0)


def stating(**facts):
    return Recording(source="made here", channels=(CHANNEL,), **facts)


@pytest.mark.parametrize(
    ("run", "healthy", "options", "expected", "code"),
    [
        ({"torque": 40.0}, [{"torque": 20.0}, {"torque": 60.0}], {}, (40.0, [20.0, 60.0]), None),
        ({"load": 50.0}, [{"load": 10.0}, {"load": 90.0}], {}, (50.0, [10.0, 90.0]), None),
        ({"torque": 40.0}, [{"torque": 20.0}], {"torque": 45.0}, (45.0, [20.0]), None),
        ({"torque": 40.0}, [{"torque": 20.0}], {"load": 50.0, "healthy_load": [30.0]}, (50.0, [30.0]), None),
        ({"load": 50.0}, [{"torque": 20.0}], {"healthy_load": [30.0]}, (50.0, [30.0]), None),
        ({"load": 50.0}, [{"torque": 20.0}], {}, (None, [None]), "some-loads-unknown"),
        ({"torque": 40.0}, [{"torque": 20.0}, {}], {}, (None, [None, None]), "some-loads-unknown"),
        ({}, [{}, {}], {}, (None, [None, None]), None),
        ({"torque": 40.0}, [], {}, (40.0, []), None),
    ],
)
def test_loads_are_those_that_all_recordings_have(run, healthy, options, expected, code):
    given = {"torque": None, "healthy_torque": (), "load": None, "healthy_load": ()} | options
    *found, notes = _loads(stating(**run), [stating(**each) for each in healthy], **given)
    assert tuple(found) == expected
    assert [note.code for note in notes] == ([code] if code else [])


@pytest.mark.parametrize(
    ("options", "says"),
    [({"load": np.nan}, "no finite number"), ({"healthy_load": (1.0, 2.0)}, "2 values for 1 healthy recordings")],
)
def test_loads_that_are_none_are_refused(options, says):
    given = {"torque": None, "healthy_torque": (), "load": None, "healthy_load": ()} | options
    with pytest.raises(InputError, match=says):
        _loads(stating(), [stating()], **given)
