"""Fewer averages for the calibration of a diagnosis: the answers of these tests are clear."""

import pytest


@pytest.fixture(scope="session", autouse=True)
def _few_tries(few_tries):
    return few_tries
