"""Targets of the fuzzer but recordings, and their cases: each is determined by a kind, a seed and a number."""

import shutil
import zlib

import numpy as np
import outcomes
from targets.arrays import arrays
from targets.statements import sql
from targets.stored import databases, models
from targets.toml_files import recipes, rigs

TARGETS = {
    "recipes": recipes, "rigs": rigs, "sql": sql, "models": models, "databases": databases, "arrays": arrays,
}  # fmt: skip


def run_case(kind, folder, seed, number):
    """Run a case in an empty folder; return its outcome, what it did and its fault, if there is one."""
    about = {}
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
    random = np.random.default_rng([zlib.crc32(kind.encode()), seed, number])
    try:
        with outcomes.bounded():
            return TARGETS[kind](folder, random, about), about, None
    except outcomes.FaultError as fault:
        return "fault", about, str(fault)
