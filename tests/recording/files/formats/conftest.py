"""Files of recordings, made by ``recording_files.py``, which ``hostile.py`` uses too."""

import importlib.util
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def files():
    spec = importlib.util.spec_from_file_location("recording_files", Path(__file__).with_name("recording_files.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
