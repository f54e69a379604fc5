"""Stored databases and models: their files are damaged, exchanged, or changed with a seal that is right."""

import atexit
import functools
import hashlib
import io
import json
import os
import shutil
import tempfile
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
from damages import damaged
from outcomes import READ, REFUSED, FaultError, answered
from targets.structures import mutated

import sigdb
from sigdb.database import database_card, sealed_json
from sigdb.database.store.seal import sealed_toml
from sigdb.pipeline import load_recipe
from sigdb.sweep import run, verify

OLD_MODEL = Path(__file__).parents[2] / "compatibility/version_0_1/location"
"""A small model, without a seal."""

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 4
specimens = 2
healthy = 3
[[sweep.grid]]
tooth = [1, 6]
stiffness_loss = [0.2, 0.4]
[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""


@functools.cache
def small_database():
    """Make a database of a few rows, once in a process."""
    place = Path(tempfile.mkdtemp(prefix="sigdb-fuzz-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    (place / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(place / "recipe.toml")
    run(recipe.plan(), place / "signatures", recipe=recipe.text, jobs=1)
    return place / "signatures"


def contents(folder):
    """Bytes of the files of a folder by name, but for a lock."""
    files = (path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


READS = {
    "cases": lambda db: db.cases(),
    "features": lambda db: db.features(),
    "signals": lambda db: db.signals(db.cases()["id"]),
    "templates": lambda db: db.templates(),
    "sql": lambda db: db.sql("select f.*, s.tsa from features f join signals s using (id) order by id"),
    "where": lambda db: db.cases("tooth > 0"),
    "card": lambda db: {key: value for key, value in database_card(db).items() if key not in ("location", "database")},
    "match": lambda db: db.match(db.signals([0])["tsa"][0], k=3).table,
}
"""Ways to read a database."""


def _same(a, b):
    """Whether two results are of the same numbers and texts."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_same(a[key], b[key]) for key in a)
    if hasattr(a, "columns"):
        return (
            list(a.columns) == list(b.columns)
            and len(a) == len(b)
            and all(_same(a[c].tolist(), b[c].tolist()) for c in a)
        )
    if isinstance(a, list | tuple | np.ndarray) and isinstance(b, list | tuple | np.ndarray):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return a is b or bool(pd.isna(a) and pd.isna(b)) or bool(a == b)


@functools.cache
def _right(way):
    return READS[way](sigdb.open(small_database()))


def _other_kind(path, random):
    """Another kind of file in the place of one: a folder, a link, nothing, a pipe."""
    path.unlink()
    match int(random.integers(4)):
        case 0:
            path.mkdir()
        case 1:
            path.symlink_to("/dev/zero")
        case 2:
            os.mkfifo(path)
    return "another kind"


def _hurt(folder, random):
    """Damage the files of a folder in one way; return the way."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    path, other = (files[int(random.integers(len(files)))] for _ in range(2))
    name = path.relative_to(folder).as_posix()
    match int(random.integers(12)):
        case 0:
            path.unlink()
            return f"{name} lost"
        case 1:
            path.write_bytes(other.read_bytes())
            return f"{name} is {other.name}"
        case 2:
            return f"{name} {_other_kind(path, random)}"
        case 3:
            shutil.copy(path, path.with_name(f"more-{path.name}"))
            return f"{name} twice"
        case _:
            before = path.read_bytes()
            data, how = damaged(before, random, text=path.suffix in (".json", ".toml", ".md"))
            path.write_bytes(data)
            return f"{name} {how}"


def databases(folder, random, about):
    """Read a damaged database in every way; it gives the right numbers or an error, and ``verify`` finds the damage."""
    copy = Path(shutil.copytree(small_database(), folder / "signatures"))
    before = contents(copy)
    if random.random() < 0.3:
        return _sealed_database(copy, random, about)
    about["damage"] = _hurt(copy, random)
    outcomes = []

    def read(way):
        got = READS[way](sigdb.open(copy))
        if not _same(got, _right(way)):
            raise FaultError("wrong numbers", f"{way} of a database with {about['damage']}")
        return READ

    for way in random.permutation(list(READS))[:4]:
        outcomes.append(answered(functools.partial(read, str(way)), about))
    findings = []

    def check():
        findings.extend(verify(copy))
        return READ

    checked = answered(check, about)
    if checked == READ and not findings and any(contents(copy).get(name) != before[name] for name in before):
        raise FaultError("not found", f"verify of a database with {about['damage']}")
    return READ if set(outcomes) == {READ} else REFUSED


def _sealed_database(copy, random, about):
    """Change a description and seal it again: nothing but errors of sigdb may come of it."""
    names = ("sigdb.toml", "schema.json", "receipts/rows-00000.json", "receipts/templates-00000.json")
    path = copy / names[int(random.integers(len(names)))]
    text = path.read_text(encoding="utf-8")
    tree = tomllib.loads(text) if path.suffix == ".toml" else json.loads(text)
    tree.pop("sha256")
    about["changes"] = [path.name, *mutated(tree, random)]
    try:
        path.write_bytes((sealed_toml if path.suffix == ".toml" else sealed_json)(tree))
    except (TypeError, ValueError, AttributeError):
        return REFUSED  # a tree that the format cannot hold
    ways = [*(lambda read=read: read(sigdb.open(copy)) for read in READS.values()), lambda: verify(copy)]
    outcomes = [answered(lambda way=way: (way(), READ)[1], about, lines=True) for way in ways]
    return READ if set(outcomes) == {READ} else REFUSED


@functools.cache
def small_model():
    """Make a sealed model, once in a process; its rows, and its answers to them."""
    place = Path(shutil.copytree(OLD_MODEL, small_database().with_name("location")))
    described = json.loads((place / "model.json").read_text(encoding="utf-8"))
    described["files"] = described.pop("sha256")
    (place / "model.json").write_bytes(sealed_json(described))
    n = 12 * 32
    noise = np.random.default_rng(1).standard_normal((3, n))
    row = {"tsa": np.cos(2 * np.pi * 12 * np.arange(n) / n) + 0.1 * noise, "speed_rpm": 19_820.0, "torque": 250.0}
    row |= {"averages": 36, "scatter": 1.0}
    return place, row, sigdb.load_model(place).assess(**row)


def models(folder, random, about):
    """Load a damaged model: it is refused, or answers as before."""
    place, row, right = small_model()
    copy = Path(shutil.copytree(place, folder / "model"))
    if random.random() < 0.5:
        return _sealed_model(copy, random, about)
    about["damage"] = _hurt(copy, random)

    def load():
        if not _same(sigdb.load_model(copy).assess(**row), right):
            raise FaultError("wrong numbers", f"model with {about['damage']}")
        return READ

    return answered(load, about)


def _sealed_model(copy, random, about):
    """Change the description or a member of an archive, and seal the model again: only errors of sigdb come of it."""
    described = json.loads((copy / "model.json").read_text(encoding="utf-8"))
    described.pop("sha256")
    name = ("model.json", "model.skops", "probe.npz")[int(random.integers(3))]
    if name == "model.json":
        about["changes"] = mutated(described, random)
    else:
        data, about["changes"] = _archive(copy / name, random)
        (copy / name).write_bytes(data)
        described["files"][name] = hashlib.sha256(data).hexdigest()
    try:
        (copy / "model.json").write_bytes(sealed_json(described))
    except (TypeError, ValueError):
        return REFUSED
    _, row, _ = small_model()
    return answered(lambda: (sigdb.load_model(copy).assess(**row), READ)[1], about)


def _archive(path, random):
    """An archive with a damaged member, or another schema."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    names = sorted(members)
    name = (
        "schema.json" if "schema.json" in members and random.random() < 0.7 else names[int(random.integers(len(names)))]
    )
    if name == "schema.json" and random.random() < 0.8:
        tree = json.loads(members[name])
        done = mutated(tree, random, ("builtins", "os", "system", "numpy", "ndarray", "object", "list", "eval", "json"))
        members[name] = json.dumps(tree, default=str).encode("utf-8", "surrogatepass")
    else:
        members[name], done = damaged(members[name], random, text=False)
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, content in members.items():
            archive.writestr(member, content)
    return written.getvalue(), [name, done]
