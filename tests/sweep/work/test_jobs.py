"""Unit: jobs of a batch system make one database together, bit for bit that of one sweep."""

import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from sigdb.core import DatabaseError, InputError
from sigdb.database import Store
from sigdb.sweep import Job, run, verify
from sigdb.sweep.work.ownership import JOBS, OWNER, ownership_of

BATCH = Path(__file__).parents[3] / "docs" / "guide" / "batch"
MANY = f"""
[[sweep.grid]]
tooth = 1
stiffness_loss = {[n / 100 for n in range(70)]}
[signature]
samples_per_tooth = 32
"""
"""A recipe with two parts of templates."""


@pytest.mark.parametrize("order", [(1, 2), (2, 1)])
def test_jobs_one_after_another_make_the_bytes_of_one_sweep(
    parts_plan, parts_folder, parts_text, digests, tmp_path, order
):
    first, last = (run(parts_plan, tmp_path / "db", recipe=parts_text, jobs=1, job=Job(i, 2)) for i in order)
    share = {1: 2048 + 5060 - 2 * 2048, 2: 2048}
    assert (first.new_rows, first.missing_rows) == (share[order[0]], share[order[1]])
    assert (last.new_rows, last.missing_rows) == (share[order[1]], 0)
    assert digests(tmp_path / "db") == digests(parts_folder)
    assert verify(tmp_path / "db") == ()


def test_a_job_makes_the_templates_that_others_have_not_made(plan_of, digests, tmp_path):
    plan = plan_of(MANY)
    assert plan.template_parts == 2
    assert run(plan, tmp_path / "jobs", jobs=1, job=Job(2, 2)).new_rows == 0  # all rows are one part, of job 1
    assert run(plan, tmp_path / "jobs", jobs=1, job=Job(1, 2)).missing_rows == 0
    run(plan, tmp_path / "one", jobs=1)
    assert digests(tmp_path / "jobs") == digests(tmp_path / "one")


def test_a_job_that_is_repeated_has_nothing_to_do(parts_plan, tmp_path):
    run(parts_plan, tmp_path, jobs=1, job=Job(3, 3))
    assert run(parts_plan, tmp_path, jobs=1, job=Job(3, 3)).new_rows == 0


def places(tmp_path, kind):
    if kind == "directory":
        return Store.at(tmp_path / "db")
    from pyarrow import fs

    (tmp_path / "place" / JOBS).mkdir(parents=True)  # an object store needs no folders
    return Store(
        location="mem://place", filesystem=fs.SubTreeFileSystem(str(tmp_path), fs.LocalFileSystem()), root="place"
    )


@pytest.mark.parametrize("kind", ["directory", "remote"])
def test_jobs_share_a_place_and_nobody_else_does(tmp_path, kind):
    store = places(tmp_path, kind)
    with ownership_of(store, "1-of-2"):
        with ownership_of(store, "2-of-2"):
            assert {*store.sizes(JOBS)} >= {f"{JOBS}/1-of-2", f"{JOBS}/2-of-2"}
            with pytest.raises(DatabaseError, match="already running"), ownership_of(store, "2-of-2"):
                pass
        with pytest.raises(DatabaseError, match="already running"), ownership_of(store):
            pass
        assert store.size(OWNER) is None
    assert not {*store.sizes(JOBS)} & {f"{JOBS}/1-of-2", f"{JOBS}/2-of-2"}
    with ownership_of(store):
        assert store.sizes(JOBS) == {}
    with ownership_of(store), pytest.raises(DatabaseError, match="already running"), ownership_of(store, "1-of-2"):
        pass
    with ownership_of(store, "1-of-2"):
        pass


def test_the_sign_of_a_job_that_was_killed_is_forgotten(parts_plan, tmp_path):
    run(parts_plan, tmp_path, jobs=1, job=Job(1, 1))
    Store.at(tmp_path).put(f"{JOBS}/1-of-2", b"{}")
    assert verify(tmp_path) == ()
    run(parts_plan, tmp_path, jobs=1)
    assert not (tmp_path / JOBS).exists()


def test_a_job_of_another_recipe_is_refused(parts_plan, plan_of, tmp_path):
    run(parts_plan, tmp_path, jobs=1, job=Job(3, 3))
    with pytest.raises(InputError, match="was made from another recipe"):
        run(plan_of(MANY), tmp_path, jobs=1, job=Job(1, 3))


@pytest.mark.parametrize("text", ["0/3", "4/3", "1", "1/0", "-1/3", "a/b", "1/3/5", ""])
def test_a_text_that_is_no_job_is_refused(text):
    with pytest.raises(InputError, match="job "):
        Job.from_text(text)


def test_failed_rows_are_not_made_again_by_a_job(parts_plan, tmp_path):
    with pytest.raises(InputError, match="without --job"):
        run(parts_plan, tmp_path, job=Job(1, 2), retry_failed=True)


def script(path, text):
    path.write_text(text, encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def test_an_array_of_slurm_makes_a_database(parts_folder, parts_text, digests, tmp_path):
    """The tasks run at once; a stand-in for sbatch sets the variables of Slurm's manual."""
    text = (BATCH / "sweep.sbatch").read_text(encoding="utf-8")
    assert re.search(r"^#SBATCH --array=1-8$", text, re.MULTILINE)
    script(tmp_path / "sigdb", f'#!/bin/sh\nexec {sys.executable} -m sigdb "$@"\n')
    (tmp_path / "recipe.toml").write_text(parts_text, encoding="utf-8")
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "SLURM_CPUS_PER_TASK": "1"}
    tasks = [
        subprocess.Popen(
            ["bash", BATCH / "sweep.sbatch", tmp_path / "recipe.toml", tmp_path / "db"],
            env=environment | {"SLURM_ARRAY_TASK_ID": str(task), "SLURM_ARRAY_TASK_COUNT": "3"},
            stdout=subprocess.PIPE,
            text=True,
        )
        for task in (1, 2, 3)
    ]
    said = [task.communicate()[0] for task in tasks]
    assert [task.returncode for task in tasks] == [0, 0, 0]
    assert all("made " in each for each in said)
    assert digests(tmp_path / "db") == digests(parts_folder)
