"""Unit: kernels configure no logging and work without a cache."""

import json
import os
import subprocess
import sys

import pytest
from numba import njit
from numba.core import caching

from sigdb.core import kernel

STATE = """
import json, logging
from numba.core import event
from sigdb.core import kernel

@kernel
def double(x):
    return 2 * x

logger = logging.getLogger("sigdb")
state = {
    "handlers": [type(handler).__name__ for handler in logger.handlers],
    "level": logger.level,
    "listeners": [str(kind) for kind, listeners in event._registered.items() if listeners],
}
print(json.dumps(state))
"""
USE = """
assert double(1.0) == 2.0
assert not event._registered["numba:compile"]
"""
SHOWN = """
from sigdb.cli.main import _log_on_stderr
with _log_on_stderr():
    double(1.0)
"""


def double(x):
    return 2 * x


def test_a_kernel_works_where_no_directory_can_be_written(monkeypatch):
    """A read-only installation of a user without a home."""
    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [])
    with pytest.raises(RuntimeError, match="cannot cache function 'double'"):
        njit(cache=True)(double)
    assert kernel(double)(1.5) == 3.0


def run(code, folder):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder), "NUMBA_OPT": "0"}
    script = folder / "script.py"
    if not script.exists():  # some versions of numba compile anew for a file that was written again
        script.write_text(code)
    return subprocess.run(
        [sys.executable, "-W", "error", script],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
        env=environment,
    )


def test_a_kernel_changes_no_state_and_compiles_in_silence(tmp_path):
    done = run(STATE + USE, tmp_path)
    assert json.loads(done.stdout) == {"handlers": ["NullHandler"], "level": 0, "listeners": []}
    assert done.stderr == ""


def test_the_command_line_shows_a_compilation_once(tmp_path):
    first, second = (run(STATE + SHOWN + USE, tmp_path).stderr for _ in range(2))
    assert first == "sigdb: compiling double for this machine; done once, it takes some seconds\n"
    assert second == ""


def test_importing_a_kernel_configures_no_logging():
    modules = "sigdb.dynamics.march.kernel, sigdb.signature.wigner_ville.lag_products"
    code = f"import logging, {modules}; print([type(h).__name__ for h in logging.getLogger('sigdb').handlers])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['NullHandler']"
