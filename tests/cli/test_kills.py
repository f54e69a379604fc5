"""Verification: a command that is killed leaves its old files or its new ones, and the same command then succeeds.

Every command that writes is killed by the system while it writes a file, and before it renames or deletes one. What
takes long and writes nothing is computed once, or left out.
"""

import importlib
import os
import resource
import shutil
import signal
import sys
import traceback
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure

import sigdb
from sigdb import ingest
from sigdb.cli.main import cli
from sigdb.core import TEMPORARY
from sigdb.database import unsealed
from sigdb.recognition import load_model
from sigdb.recording import synthetic_recording
from sigdb.sweep import verify

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
specimens = 3
healthy = 3

[[sweep.grid]]
tooth = [1, 6]
stiffness_loss = [0.2, 0.4]

[signature]
sensors = ["pinion-vertical"]

[recognition]
folds = 3
learner = "lda"
"""
TARGETS = """targets = ["location"]

[[report.figures]]
name = "sixth"
rows = ["tooth = 6 and stiffness_loss = 0.2"]
panels = ["signal"]
"""
RATE = 51.2e3
LONG = "x" * 5000
LONGEST = 100
"""Seconds after which a process that was not killed is given up."""


class Steps:
    """Renames and deletions below a folder, counted; one of them kills the process."""

    def __init__(self):
        self.folder, self.count, self.deadly = None, 0, None
        sys.addaudithook(self._hear)

    @contextmanager
    def counted(self, folder):
        """Count those below a folder."""
        self.folder, self.count = str(folder), 0
        try:
            yield self
        finally:
            self.folder = None

    def _hear(self, event, arguments):
        if self.folder is None or event not in ("os.rename", "os.remove"):
            return
        if os.fsdecode(arguments[0]).startswith(self.folder):
            self.count += 1
            if self.count == self.deadly:
                os.kill(os.getpid(), signal.SIGKILL)


STEPS = Steps()
"""A hook cannot be taken away, so there is one."""


def killed(action, folder, *, step=None, size=None):
    """Run an action in a copy of this process, and return whether it was killed.

    Parameters
    ----------
    action
        Called without arguments.
    folder
        Place of its files.
    step
        Number of the rename or deletion below the folder before which it is killed.
    size
        Bytes of a file beyond which it is killed, whichever library writes it.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads of this process do not live on in the copy
        process = os.fork()
    if process == 0:
        os._exit(_run(action, folder, step, size))
    status = os.waitpid(process, 0)[1]
    expected = signal.SIGKILL if step is not None else signal.SIGXFSZ
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == expected:
        return True
    assert os.waitstatus_to_exitcode(status) == 0, f"ended with {os.waitstatus_to_exitcode(status)}"
    return False


def _run(action, folder, step, size):
    errors = os.dup(2)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nowhere, stream)
    signal.alarm(LONGEST)
    try:
        STEPS.deadly = step
        if size is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
        with STEPS.counted(folder):
            action()
    except BaseException:
        os.write(errors, traceback.format_exc().encode())
        return 1
    return 0


@dataclass(frozen=True)
class Written:
    """A command that writes below the folder ``out``.

    ``head`` is the file that stands for all others, and absent where they are of two times. ``database`` is what
    happens to a database in ``out``: one that grows does so at each run, and one that is damaged loses a receipt.
    ``journal`` is a file that grows while the command runs, so that its beginning may be there.
    """

    words: str
    head: str = ""
    journal: str = ""
    database: str = ""


COMMANDS = {
    "new-rig": Written("{out}/rig.toml --force"),
    "describe": Written("luo-10dof --out {out}"),
    "run": Written("{run} --out {out} --jobs 1", database="made"),
    "sweep": Written("{recipe} --out {out}/db --jobs 1", database="made"),
    "ingest": Written(
        "{list} --out {out}/db --sampling-rate 51200 --tacho tacho --teeth 12 --averages 10 --jobs 1", database="made"
    ),
    "label": Written("{out}/measured {findings}", database="labelled"),
    "verify": Written("{out}/db --repair --jobs 1", database="damaged"),
    "coverage": Written("{out}/db --cases 4 --seed 1 --jobs 1 --out {out}/match.png", database="changed"),
    "refine": Written("{out}/db --match 0.9999 --cases 2 --rounds 1 --jobs 1", database="grown"),
    "identify": Written("luo-10dof {targets} --members 2 --out {out}", database="made", journal="search.jsonl"),
    "card": Written("{db} --out {out}/card.md"),
    "query": Written("{db} SQL --format csv --out {out}/rows.csv"),
    "show": Written("{db} 0 1 --out {out}"),
    "match": Written("{db} --of {measured} --where true --out {out}/among.png"),
    "export": Written("{db} {out}/rows.h5"),
    "signature": Written("{file} --sampling-rate 51200 --tacho tacho --teeth 12 --out {out}", head="index.html"),
    "diagnose": Written(
        "{file} --rig nasa-spiral-bevel --sampling-rate 51200 --tacho tacho --db {db} --out {out}", head="index.html"
    ),
    "monitor": Written("{measured} --out {out}", head="index.html"),
    "plan-measurement": Written(
        "nasa-spiral-bevel --speed 14400 --torque 356 --averages 102 --draws 200 --out {out}", head="index.html"
    ),
    "train": Written("{trained} --target location --out {out}", head="model.json"),
    "evaluate": Written("{model} {trained} --report {out}", head="index.html"),
}
READ_ONLY = {"modes", "explore", "public-sets", "add-features", "fuse", "assess"}
"""Commands that write nothing, or only by the writers of other commands: of parts, and of an ingest."""
COMPUTED = (
    ("sigdb.recording", "read_of_any_size"),
    ("sigdb.recording", "recorded_signature"),
    ("sigdb.ingest.row_parts", "recording_rows"),
    ("sigdb.diagnosis", "diagnose"),
    ("sigdb.planning", "plan_measurement"),
    ("sigdb.database", "database_card"),
    ("sigdb.sweep.density.coverage", "study"),
    ("sigdb.recognition.storage.model_folder", "skops_bytes"),
    ("sigdb.recognition.storage.model_folder", "few_rows"),
    ("sigdb.recognition.storage.model_folder", "_answers"),
    ("sigdb.recognition.storage.model_folder", "model_card"),
)
"""Functions that write nothing and are computed once for all processes."""


@pytest.fixture(scope="module")
def places(folder, tmp_path_factory):
    """Files that the commands read."""
    place = tmp_path_factory.mktemp("kills")
    (place / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    (place / "targets.toml").write_text("[[modes]]\nfrequency_hz = 700.0\nrelative_error = 0.1\n", encoding="utf-8")
    (place / "run.toml").write_text(RECIPE + TARGETS, encoding="utf-8")
    rig, damage = sigdb.load_transmission("nasa-spiral-bevel"), sigdb.Damage(tooth=6, stiffness_loss=0.4)
    channels = synthetic_recording(rig, damage, sampling_rate=RATE, revolutions=20, seed=1).channels
    samples = np.column_stack([channel.samples for channel in channels])
    names = ",".join(channel.name for channel in channels)
    np.savetxt(place / "a.csv", samples, delimiter=",", header=names, comments="", fmt="%.6g")
    CliRunner().invoke(cli, ["sweep", str(place / "recipe.toml"), "--out", str(place / "db"), "--jobs", "1"])
    (place / "list.csv").write_text("file,machine,date\na.csv,m1,2026-01-10\n", encoding="utf-8")
    (place / "findings.csv").write_text("date,machine,tooth\n2026-02-01,m1,6\n", encoding="utf-8")
    words = ["--sampling-rate", "51200", "--tacho", "tacho", "--teeth", "12", "--averages", "10", "--jobs", "1"]
    CliRunner().invoke(cli, ["ingest", str(place / "list.csv"), "--out", str(place / "measured"), *words])
    model = {"model": folder / "location", "trained": folder / "signatures"}
    return {name: place / f"{name}.toml" for name in ("recipe", "run", "targets")} | {
        "db": place / "db",
        "list": place / "list.csv",
        "measured": place / "measured",
        "findings": place / "findings.csv",
        "file": place / "a.csv",
        **model,
    }


@pytest.fixture(scope="module")
def quick(folder, evaluation):
    """Leave out what takes long and writes nothing: training, simulation of a diagnosis, pictures and pages."""

    def save(figure, place, **options):
        place.write(LONG.encode()) if hasattr(place, "write") else Path(place).write_text(LONG)

    patch = pytest.MonkeyPatch()

    def put(module, **others):
        for name, other in others.items():
            patch.setattr(importlib.import_module(module), name, other)

    def first(module, name):
        """Let a function compute once; its copies in other processes know the result."""
        compute, results = getattr(importlib.import_module(module), name), {}

        def remembered(*arguments, **options):
            if not results:
                results[0] = compute(*arguments, **options)
            return results[0]

        put(module, **{name: remembered})

    model = load_model(folder / "location")
    put("sigdb.pipeline.models", train=lambda *_, **__: model, evaluate=lambda *_, **__: evaluation)
    put("sigdb.pipeline", evaluate_model=lambda *_, **__: evaluation)
    for name in ("rig_figure", "campbell_figure", "signature_figure", "coverage_figure", "among_figure"):
        put("sigdb.pipeline.pictures", **{name: lambda *_, **__: Figure()})
    put("sigdb.report", comparison_figure=lambda *_, **__: Figure())
    put("sigdb.report.evaluation.page", evaluation_html=lambda *_, **__: LONG)
    put("sigdb.report.diagnosis.report", diagnosis_html=lambda *_, **__: LONG)
    put("sigdb.report.recording.page", page=lambda *_, **__: LONG, _signature=lambda _: {})
    for module, name in COMPUTED:
        first(module, name)
    put("sigdb.recognition", load_model=lambda _: model)
    patch.setattr(Figure, "savefig", save)
    yield
    patch.undo()


def contents(out):
    """Bytes of files that a command writes, by name; of receipts, which hold hosts and seconds, their files."""
    files = {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    files = {name: content for name, content in files.items() if not name.endswith((TEMPORARY, ".lock", ".owner"))}
    for name, content in files.items():
        if "/receipts/" in f"/{name}":
            files[name] = unsealed(content, name=name)["files"]
    return files


def prepare(written, out, db, new):
    """Put what the command finds in its folder: files of an earlier run, or a database."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    if written.database in ("changed", "damaged", "grown"):
        shutil.copytree(db, out / "db")
    if written.database == "labelled":
        shutil.copytree(db.with_name("measured"), out / "measured")
    if written.database == "damaged":
        (out / "db" / "templates" / "part-00000.parquet").write_bytes(b"damage")
    if not written.database:
        for name, content in new.items():
            (out / name).write_bytes(b"old " + content)


def check(written, out, old, new):
    """Every file is old or new, and the one that stands for all is not among files of another time."""
    left = contents(out)
    for name in {*left, *old} if written.database != "grown" else ():
        if name == written.journal and name in left and name in new:
            assert new[name].startswith(left[name])
            continue
        absent = {None} if name == written.head or written.database == "damaged" else set()
        assert left.get(name) in [old.get(name), new.get(name), *absent], name
    if written.head in left:
        assert left in (old, new)
    for manifest in out.rglob("sigdb.toml"):
        check = ingest.verify if (manifest.parent / "recordings").is_dir() else verify
        kinds = {finding.kind for finding in check(manifest.parent) if not finding.file.endswith(TEMPORARY)}
        # A file of the old labels may be left, or one of the new ones that no receipt names yet.
        left_over = {"damaged": {"damage"}, "labelled": {"foreign"}}
        assert kinds <= {"unfinished"} | left_over.get(written.database, set())


@pytest.mark.parametrize("name", COMMANDS)
def test_a_killed_command_leaves_whole_files_and_runs_again(name, places, tmp_path, quick):
    written, out = COMMANDS[name], tmp_path / "out"
    words = [word.format(out=out, **places) for word in written.words.split()]
    words = [name, *("select * from cases" if word == "SQL" else word for word in words)]

    def command():
        assert CliRunner().invoke(cli, words, catch_exceptions=False).exit_code <= (written.database == "grown")

    prepare(written, out, places["db"], {})
    with STEPS.counted(out):
        command()
        steps = STEPS.count
    new = contents(out)
    assert steps > 0
    prepare(written, out, places["db"], new)
    old = contents(out)
    assert killed(command, out, size=1)
    check(written, out, old, new)
    for step in {1 + steps // 2, steps}:
        if killed(command, out, step=step):
            check(written, out, old, new)
    command()
    if written.database == "grown":
        assert verify(out / "db") == ()
    else:
        assert contents(out) == new


def test_every_command_is_killed_or_writes_nothing():
    assert {*COMMANDS, *READ_ONLY} == set(cli.list_commands(None))
