"""A folder of small recordings of two machines, and the database of it."""

import hashlib
import shutil

import numpy as np
import pytest

from sigdb.ingest import IngestSettings, ingest

FS, TEETH, REVS_A_SECOND, SECONDS = 8192.0, 12, 20.0, 3.0
SETTINGS = {"teeth": "12", "averages": 25, "reading": {"tacho": "tacho", "sampling_rate": FS}}
TABLE = """file,machine,date,load,torque,state,tooth,label_trust,specimen
m1-a.npz,m1,2026-01-10,50,20 N m,normal,,,A
m1-b.npz,m1,2026-02-10,60,24 N m,chipped,4,seeded,A
m2-a.npz,m2,2026-01-11,50,20 N m,unknown,unknown,,
broken.npz,m2,2026-03-01,,,,,,
"""


def channels(seed, *, pulse=0.0, tooth=4):
    """Two channels of a pair of 12 and 36 uneven teeth, one of which may be weak, and a tacho on the pinion's shaft."""
    stream = np.random.default_rng(seed)
    t = np.arange(int(FS * SECONDS)) / FS
    turns = REVS_A_SECOND * t
    mesh = np.cos(2 * np.pi * TEETH * turns) + 0.4 * np.cos(2 * np.pi * 2 * TEETH * turns + 1)
    errors = 1 + 0.2 * np.random.default_rng(5).normal(size=TEETH)
    errors[tooth - 1] -= pulse
    mate = 1 + 0.2 * np.random.default_rng(6).normal(size=3 * TEETH)
    passes = (turns * TEETH).astype(int)
    x = mesh * errors[passes % TEETH] * mate[passes % (3 * TEETH)]
    tacho = 5.0 * (turns % 1 < 0.1)
    return {"a1": x + 0.1 * stream.normal(size=t.size), "a2": 2 * x + 0.1 * stream.normal(size=t.size), "tacho": tacho}


def write(path, **options):
    """Write a recording."""
    np.savez(path, **channels(**options))


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A folder of recordings with a table; one of them is no recording."""
    place = tmp_path_factory.mktemp("recordings")
    write(place / "m1-a.npz", seed=1)
    write(place / "m1-b.npz", seed=2, pulse=0.8)
    write(place / "m2-a.npz", seed=3)
    (place / "broken.npz").write_bytes(b"PK\x03\x04 no archive")
    (place / "recordings.csv").write_text(TABLE, encoding="utf-8")
    return place


@pytest.fixture(scope="session")
def write_recording():
    """Write a recording into a file: called with its path and a seed."""
    return write


@pytest.fixture(scope="session")
def settings_with():
    """Settings that differ from :func:`settings`: called with the other values."""
    return lambda **others: IngestSettings(**SETTINGS | others)


@pytest.fixture(scope="session")
def settings():
    """Averages of 25 revolutions of both channels."""
    return IngestSettings(**SETTINGS)


@pytest.fixture
def listed(folder, tmp_path):
    """A list with one recording of the folder."""
    (tmp_path / "list.csv").write_text(f"file,unit\n{folder / 'm1-a.npz'},g\n", encoding="utf-8")
    return tmp_path / "list.csv"


@pytest.fixture(scope="session")
def made(folder, settings, tmp_path_factory):
    """The database of the folder; do not change it."""
    out = tmp_path_factory.mktemp("measured") / "db"
    ingest(folder, out, settings=settings, jobs=1)
    return out


@pytest.fixture
def copy(made, tmp_path):
    """A database that may be changed."""
    shutil.copytree(made, tmp_path / "db")
    return tmp_path / "db"


@pytest.fixture
def folder_copy(folder, tmp_path):
    """A folder of recordings that may be changed."""
    shutil.copytree(folder, tmp_path / "recordings")
    return tmp_path / "recordings"


@pytest.fixture
def of_a_sweep(copy):
    """A database whose description is not that of recordings."""
    text = (copy / "sigdb.toml").read_text(encoding="utf-8").partition("\n")[2].replace("ingest", "sweep")
    seal = hashlib.sha256(text.encode()).hexdigest()
    (copy / "sigdb.toml").write_text(f'sha256 = "{seal}"\n{text}', encoding="utf-8")
    return copy
