"""Time marching of assembled second-order equations, compiled, for all comparisons with them."""

import numba
import numpy as np
import pytest


@numba.njit(cache=True, error_model="numpy")
def _runge_kutta(flow, push, rows, gain, late, damping, backlash, external, state, step, kept):
    m, n = rows.shape
    every = (len(gain) - 1) // (2 * len(kept))
    at, slope, total, force = np.zeros(2 * n), np.zeros(2 * n), np.zeros(2 * n), np.zeros(m)
    for stages in range(2 * (len(gain) - 1)):
        stage, i = stages % 4, stages // 4
        when = 2 * i + (stage + 1) // 2
        length = (0.0, 0.5, 0.5, 1.0)[stage] * step
        for j in range(2 * n):
            at[j] = state[j] + length * slope[j]
        for k in range(m):
            force[k] = -late[when, k]
            for j in range(n):
                force[k] += rows[k, j] * (gain[when, k] * at[j] + damping[k] * at[n + j])
        if backlash > 0:
            for k in range(1, m):
                force[k] *= force[0] > 0
            force[0] = max(force[0], 0.0) + min(force[0] + gain[when, 0] * backlash, 0.0)
        for j in range(n):
            acceleration = external[when, j]
            for k in range(2 * n):
                acceleration += flow[j, k] * at[k]
            for k in range(m):
                acceleration -= push[j, k] * force[k]
            slope[j], slope[n + j] = at[n + j], acceleration
        weight = (1.0, 2.0, 2.0, 1.0)[stage] * step / 6
        for j in range(2 * n):
            total[j] += weight * slope[j]
        if stage == 0 and i % every == 0:
            for j in range(n):
                kept[i // every, j], kept[i // every, n + j], kept[i // every, 2 * n + j] = (
                    at[j],
                    at[n + j],
                    slope[n + j],
                )
            for k in range(m):
                kept[i // every, 3 * n + k] = force[k]
        if stage == 3:
            for j in range(2 * n):
                state[j] += total[j]
                total[j] = 0.0


@pytest.fixture(scope="session")
def second_order():
    """March ``q'' = flow (q, q') - push f + external`` with ``f = gain(t) rows q - late(t) + damping rows q'``.

    By the classical Runge-Kutta method with equal steps. ``external`` (2 steps + 1, n), ``gain`` and ``late``
    (2 steps + 1, m) are given at the ends and the middles of the steps. With a backlash, force 0 is that where it is
    positive, ``f + gain backlash`` where this is negative, else none; the other forces act only where it is positive.
    Given back are q, q', q'' and f at the beginnings of ``samples`` equal parts, and the state at the end.
    """

    def march(flow, push, rows, *, gain, late, external, state, step, samples, damping=None, backlash=0.0):
        m, n = rows.shape
        kept, end = np.zeros((samples, 3 * n + m)), np.array(state, float)
        damping = np.zeros(m) if damping is None else np.asarray(damping, float)
        arrays = (np.ascontiguousarray(one, float) for one in (flow, push, rows, gain, late))
        _runge_kutta(*arrays, damping, backlash, np.ascontiguousarray(external), end, step, kept)
        q, v, a, force = np.split(kept.T, [n, 2 * n, 3 * n])
        return q, v, a, force, end

    return march
