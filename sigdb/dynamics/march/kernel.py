"""The kernel of the march in time. Importing this module imports numba."""

import numpy as np

from sigdb.core import FloatArray, kernel

_CLOSED, _OPEN, _BACK = 0, 1, 2


@kernel
def march_steps(
    x: FloatArray,
    f: FloatArray,
    decay: FloatArray,
    drive: FloatArray,
    outputs: FloatArray,
    compliance: FloatArray,
    static: FloatArray,
    mean: FloatArray,
    backlash: FloatArray,
    turns: FloatArray,
    rates: FloatArray,
    tables: FloatArray,
    friction: FloatArray,
    forces: FloatArray,
    lift: FloatArray,
    y: FloatArray,
    mesh_force: FloatArray,
) -> None:
    """March modal coordinates through the steps of ``turns``, in place.

    With ``x_n = z_n - sum_q g1_q f_q,n`` a step is one pass over the modes, ``x <- E x + sum_q (E g1_q + g0_q) f_q``,
    and outputs are ``Re(c x) + compliance f``. A mesh's force follows from its compression, which has a closed form
    for a closed and for an open mesh. With several meshes it comes from a linear system for each pattern of contact.

    Parameters
    ----------
    x
        (2, m) real and imaginary parts, changed in place.
    f
        (inputs,) forces at the last step, changed in place: along the meshes, friction of the first, then others.
    decay
        (2, m) E.
    drive
        (inputs, 2, m) E g1 + g0.
    outputs
        (outputs, 2, m) c, the meshes first; the imaginary part is stored negative.
    compliance
        (outputs, inputs) Re(c g1) + direct term.
    static
        (outputs,) part of the outputs that the steady torque causes.
    mean, backlash
        (meshes,) mean mesh stiffness contained in the poles, and backlash, inf for none.
    turns
        (steps,) revolutions of the first mesh's gear at the end of each step.
    rates
        (meshes,) periods of each mesh's table in a revolution.
    tables
        (meshes, 2, T + 1) stiffness and error force of each mesh over its period; the last is the first again.
    friction
        (2, 2, T + 1) or (0, 2, T + 1): for each friction input its stiffness and error force, over the first's period.
    forces
        (steps, others) other forces at the end of each step.
    lift
        (steps, meshes), or (steps, 0): error that all pairs of a mesh have in common at the end of each step, m.
    y
        (steps, outputs) results.
    mesh_force
        (steps, meshes) results: force of each mesh, 0 where it is open.
    """
    steps, m = turns.size, x.shape[1]
    meshes, Q, rows, sliding = mean.size, f.size, outputs.shape[0], friction.shape[0]
    T = tables.shape[2] - 1
    xr, xi, er, ei = x[0], x[1], decay[0], decay[1]
    p = np.zeros(rows)
    k, g, alpha, beta = np.zeros(meshes), np.zeros(meshes), np.zeros(meshes), np.zeros(meshes)
    w, v = np.zeros(2), np.zeros(2)
    state = np.zeros(meshes, np.int64)
    A, delta = np.zeros((meshes, meshes)), np.zeros(meshes)
    for n in range(steps):
        f0 = f[0]
        br, bi = drive[0, 0], drive[0, 1]
        for j in range(m):
            re = er[j] * xr[j] - ei[j] * xi[j] + br[j] * f0
            xi[j] = er[j] * xi[j] + ei[j] * xr[j] + bi[j] * f0
            xr[j] = re
        for q in range(1, Q):
            fq, br, bi = f[q], drive[q, 0], drive[q, 1]
            for j in range(m):
                xr[j] += br[j] * fq
                xi[j] += bi[j] * fq
        for o in range(rows):
            cr, ci = outputs[o, 0], outputs[o, 1]
            total = 0.0
            for j in range(m):
                total += cr[j] * xr[j] + ci[j] * xi[j]
            p[o] = static[o] + total
        for q in range(meshes + sliding, Q):
            f[q] = forces[n, q - meshes - sliding]
            for o in range(rows):
                p[o] += compliance[o, q] * f[q]

        for i in range(meshes):
            place = turns[n] * rates[i]
            place = (place - np.floor(place)) * T
            left = min(int(place), T - 1)
            part = place - left
            k[i] = tables[i, 0, left] + part * (tables[i, 0, left + 1] - tables[i, 0, left])
            g[i] = tables[i, 1, left] + part * (tables[i, 1, left + 1] - tables[i, 1, left])
            if lift.shape[1] > 0:
                g[i] += k[i] * lift[n, i]
            if i == 0:
                for q in range(sliding):
                    w[q] = friction[q, 0, left] + part * (friction[q, 0, left + 1] - friction[q, 0, left])
                    v[q] = friction[q, 1, left] + part * (friction[q, 1, left + 1] - friction[q, 1, left])
                    if lift.shape[1] > 0:
                        v[q] += w[q] * lift[n, 0]

        # The pattern of contact of the last step nearly always holds; else the pattern of the solution is next.
        for _ in range(2 * meshes + 2):
            for i in range(meshes):
                if state[i] == _OPEN:
                    alpha[i], beta[i] = 0.0, -mean[i]
                else:
                    alpha[i], beta[i] = g[i], k[i] - mean[i]
                    if state[i] == _BACK:
                        alpha[i] -= k[i] * backlash[i]
            for i in range(meshes):
                delta[i] = p[i]
                for s in range(meshes):
                    delta[i] += compliance[i, s] * alpha[s]
                    A[i, s] = compliance[i, s] * beta[s]
                A[i, i] += 1.0
                if state[0] == _CLOSED:
                    for q in range(sliding):
                        delta[i] += compliance[i, meshes + q] * v[q]
                        A[i, 0] += compliance[i, meshes + q] * w[q]
            for c in range(meshes):
                for r in range(c + 1, meshes):
                    ratio = A[r, c] / A[c, c]
                    for s in range(c + 1, meshes):
                        A[r, s] -= ratio * A[c, s]
                    delta[r] -= ratio * delta[c]
            for c in range(meshes - 1, -1, -1):
                for s in range(c + 1, meshes):
                    delta[c] -= A[c, s] * delta[s]
                delta[c] /= A[c, c]
            holds = True
            for i in range(meshes):
                pressing = k[i] * delta[i] - g[i]
                wanted = _CLOSED
                if pressing < 0.0:
                    wanted = _BACK if pressing + k[i] * backlash[i] < 0.0 else _OPEN
                if wanted != state[i]:
                    state[i] = wanted
                    holds = False
            if holds:
                break

        for i in range(meshes):
            f[i] = alpha[i] - beta[i] * delta[i]
            mesh_force[n, i] = 0.0 if state[i] == _OPEN else mean[i] * delta[i] - f[i]
        for q in range(sliding):
            f[meshes + q] = v[q] - w[q] * delta[0] if state[0] == _CLOSED else 0.0
        for o in range(rows):
            total = p[o]
            for q in range(meshes + sliding):
                total += compliance[o, q] * f[q]
            y[n, o] = total
