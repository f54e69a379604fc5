"""Unit: messages of the library in the words of the command line."""

import pytest

from sigdb.cli.options.recordings import in_options


@pytest.mark.parametrize(
    ("message", "shown"),
    [
        ("give sampling_rate, in Hz, or a column (time)", "give --sampling-rate, in Hz, or a column (--time)"),
        ("take the phase of the mesh (mesh_phase)", "take the phase of the mesh (--mesh-phase)"),
        ("set pulses_per_rev = 4", "set --pulses-per-rev 4"),
        ("give speed_range_rpm", "give --speed-range"),
        *(
            (same, same)
            for same in ("run.toml: sampling_rate = -1.0 must be greater than 0", "unknown key 'tacho_kind'")
        ),
        *((same, same) for same in ("key measurement.sampling_rate is unknown", "the time of the tacho; check units")),
    ],
)
def test_options_are_named_as_they_are_typed(message, shown):
    assert in_options(message) == shown
