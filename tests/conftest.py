"""Settings for all tests: one thread for linear algebra, so that rounding does not depend on the machine."""

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="session", autouse=True)
def _one_thread():
    with threadpool_limits(1):
        yield
