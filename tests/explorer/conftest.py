import pytest
from starlette.testclient import TestClient

import sigdb
from sigdb.explorer import LiveRig
from sigdb.explorer.app import Explorer, explorer_app


@pytest.fixture(scope="session")
def live():
    return LiveRig(sigdb.load_transmission("nasa-spiral-bevel"))


@pytest.fixture(scope="session")
def database(explored):
    return sigdb.open(explored)


@pytest.fixture(scope="session")
def app(live, database):
    explorer = Explorer(live, "nasa-spiral-bevel", database=database)
    yield explorer_app(explorer, token="secret", hosts=("127.0.0.1:8000",))
    explorer.recordings.close()


@pytest.fixture
def client(app):
    return TestClient(app, base_url="http://127.0.0.1:8000", headers={"X-Sigdb-Token": "secret"})
