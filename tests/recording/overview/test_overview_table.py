"""Unit: the table of what was read, and notes on faults of samples."""

import numpy as np
import pytest

from sigdb.recording import Channel, Recording, read_recording

FS = 12_800.0
RNG = np.random.default_rng(9)
NOISE = RNG.normal(size=12_800)


def written(path, *, tacho="n"):
    clipped = np.clip(NOISE, -2, 2)
    spiked = NOISE[::-1].copy()
    spiked[6400] = 60
    np.savez(path, a=clipped, b=spiked, c=np.zeros(12_800), n=5.0 * (np.arange(12_800) % 640 < 64), k=np.arange(12_800))
    return read_recording(path, sampling_rate=FS, tacho=tacho, units="g")


def test_a_row_for_each_channel_and_part(tmp_path):
    table = written(tmp_path / "run.npz").overview()
    assert table["channel"].tolist() == ["a", "b", "c", "n", "k"]
    a, b, c, n, k = (row for _, row in table.iterrows())
    assert (a["unit"], a["sampling_rate"], a["rate_from"]) == ("g", FS, "sampling_rate")
    assert (a["start"], a["duration"], a["samples"], a["least"], a["greatest"]) == (0, 1, 12_800, -2, 2)
    assert a["clipped"] == np.count_nonzero(np.abs(NOISE) >= 2) / 12_800
    assert a["rms"] == pytest.approx(np.sqrt(np.mean(np.clip(NOISE, -2, 2) ** 2)))
    assert (b["spikes"], b["drop_outs"], b["clipped"]) == (1, 0, 0)
    assert (c["rms"], c["clipped"], c["drop_outs"]) == (0, 0, 0)
    assert table.loc[3, ["clipped", "spikes", "drop_outs"]].isna().all()
    assert n["greatest"] == 5
    assert k["left_out"] == "k counts samples and was left out"
    assert table["left_out"].tolist()[:4] == [""] * 4


def test_notes_on_faults(tmp_path):
    notes = {note.code: note for note in written(tmp_path / "run.npz").notes}
    outside = np.abs(NOISE) >= 2
    assert notes["clipped"].values["channel"] == "a"
    assert notes["clipped"].values["share"] == pytest.approx(outside.mean())
    assert notes["clipped"].values["first_s"] == pytest.approx(np.argmax(outside) / FS)
    assert dict(notes["spikes"].values) == {
        "channel": "b",
        "count": 1,
        "samples": 1,
        "share": 1 / 12_800,
        "first_s": 0.5,
    }
    assert notes["spikes"].text == (
        "b: 1 samples in 1 places (0.0078 %), first at 0.5 s, are single and far outside, as spikes are; indicators of "
        "peaks are wrong"
    )
    assert notes["constant-channel"].text == "c is constant"


def test_a_recording_by_hand():
    channel = Channel(name="a", samples=NOISE, sampling_rate=FS, start=2.5)
    table = Recording(source="here", channels=(channel,)).overview()
    assert table.loc[0, "rate_from"] == "the caller"
    assert table.loc[0, "start"] == 2.5
    assert len(table) == 1


@pytest.mark.parametrize("value", [0.0, 1e-300, 1e300])
def test_levels_of_any_size(value):
    channel = Channel(name="a", samples=value * NOISE, sampling_rate=FS)
    row = Recording(source="here", channels=(channel,)).overview().loc[0]
    assert row["rms"] == pytest.approx(value * np.sqrt(np.mean(NOISE**2)))
