"""Unit: linear algebra of a rig uses one thread, whatever the setting."""

import numpy as np
from threadpoolctl import threadpool_info, threadpool_limits

import sigdb
from sigdb.transmission import modal_system


def threads_of(kind):
    return [each["num_threads"] for each in threadpool_info() if each["user_api"] == kind]


def test_linear_algebra_of_a_rig_uses_one_thread_and_leaves_the_setting(monkeypatch):
    seen = []
    eigenvalues = np.linalg.eig
    monkeypatch.setattr(np.linalg, "eig", lambda matrix: seen.append(threads_of("blas")) or eigenvalues(matrix))
    with threadpool_limits(2, user_api="blas"):
        before = threads_of("blas")
        modal_system(sigdb.load_transmission("nasa-spiral-bevel"))
        assert threads_of("blas") == before
    assert seen == [[1] * len(before)]
    assert before != seen[0]
