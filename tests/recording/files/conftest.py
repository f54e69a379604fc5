"""Files of recordings, made by ``recording_files.py``, which the fuzzer uses too, and by ``matlab_files.py``."""

import importlib.util
from pathlib import Path

import pytest


def _module(name):
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name("formats") / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def files():
    return _module("recording_files")


@pytest.fixture(scope="session")
def matlab():
    return _module("matlab_files")
