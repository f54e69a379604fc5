"""Extension: the additions of the page for contributors touch the files that it names, and work."""

import ast
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import sigdb

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "contributing.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```\{code-block\} python\n:caption: (\S+), (.+?)\n\n(.*?)^```$", re.MULTILINE | re.DOTALL)

FILES = {
    "Add an indicator": ["signature/indicators/average.py", "signature/indicators/indicator_table.py"],
    "Add a learner": ["recognition/estimators/baselines/tooth_energy.py", "recognition/estimators/registry.py"],
    "Add a file format": ["recording/files/formats/json_file.py", "recording/files/kinds.py"],
    "Add a command": ["cli/commands/teeth.py"],
}

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 1
specimens = 4
draws = 2
healthy = 6

[[sweep.grid]]
tooth = [1, 6]
stiffness_loss = [0.2, 0.4]

[measurement]
snr_db = 30.0
index_error = 0.0

[signature]
sensors = ["pinion-vertical"]
samples_per_tooth = 32
"""


def sections():
    """The text of each section of the page, by its heading."""
    parts = re.split(r"^## (.+)$", PAGE, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def added(path, place, code):
    """The text of a file with an addition of the page."""
    if place == "a new file":
        assert not path.exists(), f"{path} exists"
        return code
    text = path.read_text(encoding="utf-8")
    if place == "at the end":
        return f"{text}\n\n{code}"
    lines, tree = text.splitlines(keepends=True), ast.parse(text)
    if place == "with the imports":
        last = max(node.end_lineno for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom))
        return "".join([*lines[:last], code, *lines[last:]])
    name = re.fullmatch(r"in (\w+)", place).group(1)
    (table,) = [
        node
        for node in tree.body
        if (isinstance(node, ast.Assign) and node.targets[0].id == name)
        or (isinstance(node, ast.AnnAssign) and node.target.id == name)
    ]
    end = table.end_lineno - 1
    return "".join([*lines[:end], code, *lines[end:]])


def digest(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*.py")}


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the source, with what is compiled, and all additions; and the files that each touched."""
    folder = tmp_path_factory.mktemp("copy")
    source = Path(sigdb.__file__).parent
    shutil.copytree(source, folder / "sigdb")
    shutil.copytree(ROOT / "data" / "transmissions", folder / "data" / "transmissions")
    touched = {}
    for heading, text in sections().items():
        if not heading.startswith("Add "):
            continue
        before = digest(folder / "sigdb")
        for file, place, code in BLOCK.findall(text):
            path = folder / file
            path.write_text(added(path, place, code), encoding="utf-8")
        after = digest(folder / "sigdb")
        touched[heading] = sorted(name for name in after if after[name] != before.get(name))
    return folder, touched


def run(copy, *arguments, code=None):
    """Run code, or a module with arguments, in a fresh interpreter that imports the copy."""
    folder, _ = copy
    line = [sys.executable, *(("-c", code) if code else ("-m", *arguments))]
    done = subprocess.run(
        line,
        cwd=folder,
        env={"PYTHONPATH": str(folder), "PATH": "", "HOME": str(folder)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def database(copy):
    """A small database that the copy makes, by its path."""
    folder, _ = copy
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    run(copy, "sigdb", "sweep", "recipe.toml", "--out", "signatures", "--jobs", "1")
    return folder / "signatures"


@pytest.mark.parametrize("heading", FILES)
def test_an_addition_touches_the_files_that_the_page_names(copy, heading):
    _, touched = copy
    assert touched[heading] == FILES[heading]
    assert ("One file:" if len(FILES[heading]) == 1 else "Two files:") in sections()[heading]


def test_the_copy_is_used(copy):
    assert run(copy, code="import sigdb; print(sigdb.__file__)").strip() == str(copy[0] / "sigdb" / "__init__.py")


def test_an_indicator_becomes_a_column_of_a_database(copy, database):
    code = f"""
import sigdb
import numpy as np
from sigdb.signature import indicators
rows = sigdb.open({str(database)!r})
features, signals = rows.features(), rows.signals(np.arange(len(rows)))["tsa"].astype(float)
root = np.mean(np.sqrt(np.abs(signals)), axis=1) ** 2
np.testing.assert_allclose(features["clearance_factor"], np.abs(signals).max(axis=1) / root, rtol=1e-3)
field = rows.dataset("features").schema.field("clearance_factor")
print(field.metadata[b"description"].decode())
"""
    assert run(copy, code=code).startswith("Largest modulus of the average over the squared mean")


def test_a_format_is_read(copy):
    content = {"sampling_rate": 1000.0, "channels": {"a1": [0.0, 1.0, 2.0], "tacho": [0.0, 1.0, 0.0]}}
    (copy[0] / "run.json").write_text(json.dumps(content))
    code = """
import sigdb
recording = sigdb.read_recording("run.json")
print([(channel.name, channel.samples.tolist(), channel.sampling_rate) for channel in recording.channels])
"""
    assert run(copy, code=code).strip() == "[('a1', [0.0, 1.0, 2.0], 1000.0), ('tacho', [0.0, 1.0, 0.0], 1000.0)]"


def test_a_command_shows_its_help_and_runs(copy):
    assert "teeth" in run(copy, "sigdb", "--help")
    assert "List the gears of a rig" in run(copy, "sigdb", "teeth", "--help")
    assert run(copy, "sigdb", "teeth", "nasa-spiral-bevel").splitlines() == ["pinion: 12", "gear: 36"]


def test_a_learner_trains_and_predicts(copy, database):
    """By its name, as a recipe gives it; the command offers it too."""
    code = f"""
import numpy as np
import sigdb
from sigdb.recognition.estimators.registry import make_estimators
from sigdb.recognition.settings import RecognitionSettings
database = sigdb.open({str(database)!r})
rows = database.features()
rows["tsa"] = list(database.signals(np.arange(len(rows)))["tsa"])
settings = RecognitionSettings(learner="tooth_energy", false_alarm_rate=0.1)
estimator = make_estimators("location", settings, None)[settings.learner].fit(rows, rows["tooth"], rows["specimen"])
print(type(estimator).__name__, *estimator.predict(rows[(rows["tooth"] == 6) & (rows["stiffness_loss"] == 0.4)]))
"""
    name, *teeth = run(copy, code=code).split()
    assert name == "ToothEnergyLocation"
    assert set(teeth) <= {"6", "7"}  # the response comes late: its energy is greatest a tooth pass later
    assert "tooth_energy" in run(copy, "sigdb", "train", "--help")
