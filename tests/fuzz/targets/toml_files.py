"""Recipes and rigs: files of TOML, changed in their tables or in their bytes."""

import tomllib
from pathlib import Path

import numpy as np
from damages import damaged
from outcomes import READ, FaultError, answered
from targets.structures import mutated, toml_bytes

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.transmission import describe_rig

ROOT = Path(__file__).parents[3]
RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 3
specimens = 3
draws = 2
healthy = 20
[[sweep.grid]]
tooth = [1, 6, 12]
damaged_teeth = [1, 2]
stiffness_loss = [0.0, 0.4]
phase_shift_deg = {min = 0.0, max = 2.0}
points = 5
[[sweep.grid]]
tooth = "all"
pattern = "both"
snr_db = [-10.0, 20.0]
averages = [3, 102]
index_error = [0.0, 5e-6]
operating.torque = [300.0, 200.0]
pinion.teeth = 13
[sweep.patterns]
both = [{ stiffness_loss = 0.4, loss_extent = 0.2 }, {}, { phase_shift_deg = 1.0 }]
[measurement]
snr_db = 0.0
index_error = 2e-6
[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
[recognition]
folds = 3
learner = "lda"
targets = ["location"]
[report]
dots_per_inch = 50
[[report.figures]]
name = "both"
rows = ["tooth = 12 and stiffness_loss = 0.2"]
panels = ["signal"]
"""
WORDS = ("all", "pinion", "gear", "main", "tooth", "stiffness_loss", "phase_shift_deg", "crack_depth", "pattern",
         "averages", "points", "teeth", "torque", "operating.speed_rpm", "nasa-spiral-bevel", "luo-10dof", "sensors",
         "seed", "1.5 mm", "30 kN m", "2 deg")  # fmt: skip


def _file(folder, name, text, random, about):
    """A file after changes of its tables, of its bytes, or of both."""
    data = text.encode()
    if random.random() < 0.8:
        tree = tomllib.loads(text)
        about["changes"] = mutated(tree, random, WORDS)
        data = toml_bytes(tree)
    if random.random() < 0.25 or "changes" not in about:
        data, about["damages"] = damaged(data, random, text=True)
    path = folder / name
    path.write_bytes(data)
    return path


def recipes(folder, random, about):
    """Load a recipe and plan its rows."""
    files = [
        RECIPE,
        RECIPE,
        *(path.read_text(encoding="utf-8") for path in sorted((ROOT / "pipelines").glob("*.toml"))),
    ]
    path = _file(folder, "recipe.toml", files[int(random.integers(len(files)))], random, about)

    def plan():
        recipe = load_recipe(path)
        for other in (recipe, *recipe.evaluated_on()):
            made = other.plan()
            rows = made.table_of(made.sample_ids(5, 5))
            if not 0 < len(rows) <= made.rows:
                raise FaultError("unsound", f"{len(rows)} of {made.rows} rows")
        return READ

    return answered(plan, about, lines=True)


def rigs(folder, random, about):
    """Load a rig, describe it and, sometimes, simulate it."""
    paths = sorted((ROOT / "data/transmissions").glob("*.toml"))
    path = paths[int(random.integers(len(paths)))]
    path = _file(folder, "rig.toml", path.read_text(encoding="utf-8"), random, about)
    simulated = random.random() < 0.3

    def describe():
        rig = sigdb.load_transmission(path)
        describe_rig(rig)
        if simulated and len(rig.meshes) == 1:
            response = sigdb.simulate(rig)
            if not all(np.isfinite(signal).all() for signal in response.signals.values()):
                raise FaultError("unsound", "the response is not finite")
        return READ

    return answered(describe, about, lines=True)
