"""Verification: the format of a file follows from an option, its suffix and its first bytes."""

import gzip

import numpy as np
import pytest
from scipy.io import wavfile

from sigdb.core.errors import InputError
from sigdb.recording import read_recording

X = np.sin(np.arange(200.0))
ROWS = "time,a\n" + "".join(f"{i / 1000},{x:.6f}\n" for i, x in enumerate(X))


def npy(path):
    np.save(path.with_suffix(".npy"), X)
    return path.with_suffix(".npy").rename(path)


def npz(path):
    np.savez(path.with_suffix(".npz"), a=X)
    return path.with_suffix(".npz").rename(path)


def wav(path):
    wavfile.write(path.with_suffix(".wav"), 1000, X)
    return path.with_suffix(".wav").rename(path)


def csv(path):
    path.write_text(ROWS, encoding="utf-8")
    return path


def packed(path):
    path.write_bytes(gzip.compress(ROWS.encode()))
    return path


@pytest.mark.parametrize("name", ["run", "run.001", "run.bin", "run.2023"])
@pytest.mark.parametrize(("make", "kind"), [(npy, "NPY"), (npz, "NPZ"), (wav, "WAV")])
def test_files_without_a_known_suffix_are_recognised_by_their_first_bytes(tmp_path, name, make, kind):
    read = read_recording(make(tmp_path / name), sampling_rate=1000)
    np.testing.assert_array_equal(read.channels[0].samples, X)
    assert f"read as {kind} by its first bytes" in [note.text for note in read.notes]


@pytest.mark.parametrize("make", [csv, packed])
@pytest.mark.parametrize("name", ["run", "run.dat7", "run.1"])
def test_text_without_a_known_suffix_is_named_by_an_option(tmp_path, name, make):
    path = make(tmp_path / name)
    with pytest.raises(InputError, match=r"begins like (text|gzip), .* give file_format = 'csv(\.gz)?'"):
        read_recording(path)
    for file_format in ("csv", ".csv", "TXT", "text", *(["csv.gz"] if make is packed else [])):
        read = read_recording(path, file_format=file_format)
        assert [(channel.name, channel.sampling_rate) for channel in read.channels] == [("a", pytest.approx(1000))]
        assert not [note for note in read.notes if note.code == "format-by-content"]


@pytest.mark.parametrize(
    ("make", "name", "file_format", "message"),
    [
        (
            npy,
            "run.csv",
            "csv",
            r"is text or gzip by file_format = 'csv', but begins like NPY; .* or file_format = 'npy'",
        ),
        (csv, "run", "wav", "is WAV by file_format = 'wav', but begins like text"),
        (csv, "run.csv", "xyzzy", "file_format = 'xyzzy' is not known; known: "),
        (csv, "run.csv", "cvs", "file_format = 'cvs' is not known; did you mean 'csv'"),
        (npy, "run.wav", None, r"is WAV by its suffix .wav, but begins like NPY; .* file_format = 'npy'"),
    ],
)
def test_formats_that_do_not_fit(tmp_path, make, name, file_format, message):
    path = make(tmp_path / name.replace(".csv", ""))
    path = path.rename(tmp_path / name)
    with pytest.raises(InputError, match=message):
        read_recording(path, file_format=file_format)


def test_an_option_overrules_a_wrong_suffix(tmp_path):
    path = npy(tmp_path / "run").rename(tmp_path / "run.wav")
    assert read_recording(path, file_format="npy", sampling_rate=10).channels[0].samples.size == 200
    path = csv(tmp_path / "run.mat")
    assert read_recording(path, file_format="csv").channels[0].samples.size == 200


def test_bytes_like_no_format(tmp_path):
    (tmp_path / "run").write_bytes(bytes([0, 1, 2, 3] * 100))
    with pytest.raises(
        InputError, match=r"has the suffix \(none\) and begins like no format that is read; known: .csv"
    ):
        read_recording(tmp_path / "run")


def test_a_format_in_the_side_file(tmp_path):
    csv(tmp_path / "run.7")
    (tmp_path / "run.toml").write_text('file_format = "csv"\n', encoding="utf-8")
    assert read_recording(tmp_path / "run.7").channels[0].name == "a"


def test_a_column_that_begins_like_a_universal_file_is_text_by_its_suffix(tmp_path):
    (tmp_path / "run.txt").write_text("".join(f"{i}\n" for i in [-1, 58, *range(40)]), encoding="utf-8")
    assert read_recording(tmp_path / "run.txt", sampling_rate=10).channels[0].samples[1] == 58
