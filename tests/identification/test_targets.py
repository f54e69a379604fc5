"""Files of targets: what they hold, and what is refused with which sentence."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.core import InputError
from sigdb.identification import Targets, load_targets
from sigdb.identification.targets import matched_modes
from sigdb.transmission import CoupledModes

MODE = '[[modes]]\nfrequency_hz = "24.7 Hz"\nrelative_error = 0.01\n'


def load(tmp_path, text):
    path = tmp_path / "targets.toml"
    path.write_text(text, encoding="utf-8")
    return load_targets(path)


def test_a_file_states_numbers_with_their_errors(tmp_path):
    text = MODE + 'damping_ratio = 0.02\ndamping_error = 0.005\nheld_out = true\n[[deflections]]\nsensor = "across"\n'
    targets = load(
        tmp_path, text + 'force_at = "across"\nforce = "1 kN"\ndeflection = "-0.4 mm"\nrelative_error = 0.1\n'
    )
    stated = [(one.unit, one.value, one.held_out) for one in targets.quantities]
    assert stated == [("Hz", 24.7, True), ("-", 0.02, True), ("m", -0.0004, False)]
    assert [one.error for one in targets.quantities] == pytest.approx([0.247, 0.005, 4e-5])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "no target; give tables such as [[modes]] or [[deflections]]"),
        ("[[modes]]\nfrequency_hz = 24.7\n", "modes.1: frequency_hz = 24.7 has no error; give error_hz or"),
        (MODE + "error_hz = 0.1\n", "has error_hz and relative_error; give error_hz or relative_error"),
        (MODE + "damping_ratio = 0.1\n", "damping_ratio and damping_error go together"),
        (MODE + "held_out = true\n", "all targets are held out, so nothing is fitted"),
        (MODE.replace("24.7 Hz", "-1 Hz"), "modes.1.frequency_hz = -1.0 must be greater than 0"),
        (MODE + "frequncy_hz = 2\n", "unknown key modes.1.frequncy_hz; did you mean 'frequency_hz'?"),
        ('[[deflections]]\nsensor = "across"\ndeflection = 1e-5\nerror = 1e-6\nforce = 1.0\n', "force and force_at go"),
        ('[[deflections]]\nsensor = "across"\ndeflection = 0.0\nerror = 1e-6\n', "says nothing of stiffness"),
    ],
)
def test_a_mistake_is_a_sentence(tmp_path, text, sentence):
    with pytest.raises(InputError) as refused:
        load(tmp_path, text)
    assert str(refused.value).startswith(f"{tmp_path / 'targets.toml'}: ")
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("targets", "sentence"),
    [
        (
            {"modes": [{"frequency_hz": 9.0, "error_hz": 1.0, "moves": "shaft bendin"}]},
            "modes.1: moves = 'shaft bendin'",
        ),
        ({"deflections": [{"sensor": "acros", "deflection": 1e-5, "error": 1e-6}]}, "did you mean 'across'?"),
        ({"deflections": [{"sensor": "across", "deflection": 1e-5, "error": 1e-6}]}, "has no torque"),
    ],
)
def test_targets_that_do_not_fit_a_rig_are_refused(wheel, targets, sentence):
    with pytest.raises(InputError, match=r"^(modes|deflections).1: ") as refused:
        Targets(**targets).check(wheel)
    assert sentence in str(refused.value)


def test_a_target_takes_the_nearest_mode_of_its_body_and_no_mode_twice():
    modes = CoupledModes(
        frequency_hz=np.array([0.0, 10.0, 11.0, 12.0]),
        damping_ratio=np.full(4, 0.01),
        moves=({"a": 1.0}, {"a": 1.0}, {"b": 0.9, "a": 0.1}, {"a": 0.8, "b": 0.2}),
    )
    stated = [{"frequency_hz": f, "error_hz": 0.1, "moves": name} for f, name in ((11.1, "a"), (11.2, "a"))]
    assert_array_equal(matched_modes(modes, Targets(modes=stated).modes), [1, 3])
    anywhere = [{"frequency_hz": 11.1, "error_hz": 0.1}]
    assert_array_equal(matched_modes(modes, Targets(modes=anywhere).modes), [2])
    with pytest.raises(InputError, match="3 modes that oscillate, fewer than the 4 targets"):
        matched_modes(modes, Targets(modes=4 * anywhere).modes)
