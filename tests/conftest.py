"""For all tests: one thread for linear algebra, so that rounding is the same everywhere, and shared fixtures."""

import gc
import os
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from scipy.linalg import eigh, null_space
from threadpoolctl import threadpool_limits

from sigdb.dynamics.march.marcher import Marcher, MeshTables
from sigdb.transmission import MeshElement, ModalSystem
from sigdb.transmission.system.assembly import assemble

settings.register_profile("suite", deadline=None, max_examples=40)  # a busy machine is no failure
settings.load_profile("suite")

SLOW = (
    *("sweep", "recognition", "diagnosis", "cli", "pipeline", "recipes", "models"),
    *("docs", "architecture", "verification", "report", "database", "dynamics"),
)
"""Folders and files that take longest, the slowest first."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Several workers begin with what is slow, so that none has a long file left at the end."""

    def rank(item):
        path = item.path.relative_to(Path(__file__).parent)
        return next((i for i, name in enumerate(SLOW) if path.is_relative_to(name)), len(SLOW))

    if hasattr(config, "workerinput"):
        items.sort(key=rank)


gc.disable()  # while tests are collected, since they are no garbage


def pytest_collection_finish():
    """Let the collector of garbage pass over the tests and modules, which took a quarter of the suite's time."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def _one_thread():
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory):
    """No test reads or writes the cache of who runs it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIGDB_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session", autouse=True)
def _no_waiting_for_disks():
    """No power fails here, so that files need not reach the disk."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda descriptor: None)
        yield


@pytest.fixture(scope="session")
def few_trees():
    """Boosting of a quarter of the trees, which suffice for small databases."""
    from sigdb.recognition.estimators import pooled_location

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(pooled_location._BOOSTED, "max_iter", 25)
        yield


@pytest.fixture(scope="session")
def few_tries():
    """The power of a diagnosis comes from one rig at each tooth, which suffices where the answer is clear."""
    from sigdb.diagnosis.change import power

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(power, "_MOST_TRIES", 12)
        yield


@pytest.fixture(scope="session")
def oscillator():
    """A unit mass on one mesh, ``x'' + 2 zeta w x' + (w^2 - mean) x + mesh force = force + others``, in the kernel.

    It is called with the mesh's stiffness over its period (the last sample is the first again) and the step.
    ``w^2 = total`` is the mean of the mesh's stiffness, if it is left out, or that with a spring parallel to it.
    Further ``elements`` may act on the mass through column 0 and row 0.
    """

    def made(stiffness, step, *, zeta=0.0, force=0.0, backlash=None, mean=1.0, total=None, error=0.0, elements=()):
        omega = np.sqrt(total or mean)
        pole = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
        inputs = np.outer([1, -1], [1, force, 1, 0, 0]) / (2j * pole.imag)
        system = ModalSystem(
            poles=np.array([pole, pole.conjugate()]),
            inputs=inputs,
            outputs=np.array([[1, 1], [pole, pole.conjugate()]]),
            direct=np.zeros((2, 5)),
            meshes=("main",),
            sensors=("velocity",),
            mesh_stiffness=np.array([mean]),
        )
        tables = MeshTables(
            rates=np.ones(1),
            forces=np.array([[stiffness, error * stiffness]]),
            friction=np.zeros((0, 2, len(stiffness))),
        )
        mesh = MeshElement(name="main", columns=(0, 3, 4), rows=(0,), mean_stiffness=mean, backlash=backlash)
        march = Marcher(system, [mesh, *elements], tables, step, np.eye(5)[:, [2]])
        return OscillatorMarch(march, pole)

    return made


@pytest.fixture(scope="session")
def undamped_frequencies():
    """Natural frequencies, Hz, rising, of a rig at rest without damping and without the train's free rotation.

    ``det(K + sum h kbar h' - w^2 M) = 0``, with the symmetric part of the bearings' stiffness.
    """

    def frequencies(rig):
        parts = assemble(rig)
        stiffness = parts.stiffness + parts.meshes @ np.diag(parts.mesh_stiffness) @ parts.meshes.T
        elastic = null_space((parts.mass @ parts.free_rotation)[None])
        both = [elastic.T @ matrix @ elastic for matrix in ((stiffness + stiffness.T) / 2, parts.mass)]
        return np.sqrt(eigh(*both, eigvals_only=True).clip(min=0)) / (2 * np.pi)

    return frequencies


class OscillatorMarch:
    """The oscillator in motion. Its modal coordinate z gives ``x = 2 Re z`` and ``x' = 2 Re(pole z)``."""

    def __init__(self, marcher, pole):
        self._marcher, self._pole = marcher, pole

    def __call__(self, x, v, steps, *, turns=None, forces=None):
        """Compression, velocity and mesh force at the start and after each of the steps; x is from the static place.

        ``turns`` and ``forces`` (steps + 1,) are periods of the stiffness and other forces.
        """
        turns = np.zeros(steps + 1) if turns is None else turns
        forces = np.zeros(steps + 1) if forces is None else forces
        z = x / 2 + 1j * (self._pole.real * x / 2 - v / 2) / self._pole.imag
        first, first_force = self._marcher.start(np.array([z]), turns[0], forces[:1], np.zeros(0))
        outputs, mesh_force = self._marcher.run(turns[1:], forces[1:, None], np.zeros((steps, 0)))
        return (*np.vstack([first, outputs]).T, np.concatenate([first_force, mesh_force[:, 0]]))


EXPLORED = """
[sweep]
rig = "nasa-spiral-bevel"
gear = "pinion"
seed = 1
healthy = 2

[[sweep.grid]]
tooth = "all"
stiffness_loss = [0.2, 0.4]

[measurement]
averages = 102
snr_db = 10.0
"""


@pytest.fixture(scope="session")
def explored(tmp_path_factory):
    """The folder of a database for the explorer: two healthy rows, and two losses at each of twelve teeth."""
    from sigdb.pipeline import load_recipe
    from sigdb.sweep import run

    folder = tmp_path_factory.mktemp("explored")
    (folder / "recipe.toml").write_text(EXPLORED, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "db", recipe=recipe.text, jobs=1)
    return folder / "db"


@pytest.fixture(scope="session")
def object_store():
    """The address of a local server that speaks S3."""
    from moto.server import ThreadedMotoServer

    keys = {"ACCESS_KEY_ID": "test", "SECRET_ACCESS_KEY": "test", "EC2_METADATA_DISABLED": "true"}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in keys.items():
            patch.setenv(f"AWS_{name}", value)
        server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
        server.start()
        yield "{}:{}".format(*server.get_host_and_port())
        server.stop()


@pytest.fixture
def place_in_bucket(object_store, request):
    """A place in a new bucket."""
    bucket = f"bucket{abs(hash(request.node.nodeid))}"
    urllib.request.urlopen(urllib.request.Request(f"http://{object_store}/{bucket}", method="PUT"))
    return f"s3://{bucket}/some/prefix?scheme=http&endpoint_override={object_store}&region=us-east-1"
