"""The surface of the layer: names, the table of indicators, imports kept light."""

import subprocess
import sys

import numpy as np
import pytest

from sigdb import signature
from sigdb.signature import INDICATORS, indicators

NAMES = [
    "rms",
    "peak_to_peak",
    "crest_factor",
    "kurtosis",
    "energy_operator",
    "fm0",
    "fm4",
    "m6a",
    "m8a",
    "energy_ratio",
    "sideband_index",
    "sideband_level_factor",
    "sideband_energy_ratio",
]


def test_the_table_of_indicators_is_complete_and_in_order():
    assert list(INDICATORS) == NAMES
    assert all(indicator.name == name for name, indicator in INDICATORS.items())
    assert {name for name in NAMES if INDICATORS[name].unit == "signal"} == {"rms", "peak_to_peak", "sideband_index"}
    assert {indicator.unit for indicator in INDICATORS.values()} == {"signal", "-"}


def test_help_and_formula_are_single_lines():
    for indicator in INDICATORS.values():
        assert indicator.help.endswith(".")
        assert indicator.formula
        assert "\n" not in indicator.help + indicator.formula


def test_the_table_cannot_be_changed():
    with pytest.raises(TypeError):
        INDICATORS["rms"] = INDICATORS["fm0"]
    with pytest.raises(AttributeError):
        INDICATORS["rms"].unit = "-"


def test_indicators_come_in_the_order_of_the_table():
    assert list(indicators(np.arange(64.0), teeth=8)) == NAMES


def test_every_indicator_and_every_exported_name_is_there():
    assert set(NAMES) <= set(signature.__all__)
    assert all(hasattr(signature, name) for name in signature.__all__)
    assert list(signature.__all__) == sorted(signature.__all__, key=lambda name: (not name.isupper(), name))


def test_importing_the_layer_imports_no_numba_and_no_other_layer():
    code = (
        "import sys, sigdb.signature; "
        "print([m for m in sys.modules if m == 'numba' "
        "or m.startswith('sigdb.') and m.split('.')[1] not in ('core', 'signature')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
