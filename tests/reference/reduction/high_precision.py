"""Hankel singular values of the paper's 12 x 12 mesh with 200 bits: python high_precision.py N [CELLS]

Needs numpy, mpmath and python-flint. The system is projected on its answers at N real frequencies (N = 22 and 28 agree to 2e-10 in the values kept),
its Gramians there are written down mode by mode, and the values are the eigenvalues of a Gramian times the symmetriser of the transfer function.
"""

import itertools
import json
import sys

import mpmath as mp
from flint import arb, arb_mat, ctx

ctx.prec = mp.mp.prec = 200


def mesh(n):
    """K/k, K_fi/k as multiples of 1/2 for n x n cells, coordinates of the free nodes first to last."""
    nodes = list(itertools.product(range(n + 1), repeat=2))
    middle = ((n + 1) // 2, n)
    free = [p for p in nodes if 0 < p[0] < n and p[1] > 0 and p != middle]
    place = {p: i for i, p in enumerate(free)}
    size = 2 * len(free)
    k, coupling = [[0] * size for _ in range(size)], [[0] * 2 for _ in range(size)]
    for p in free:
        for d in itertools.product((-1, 0, 1), repeat=2):
            q = (p[0] + d[0], p[1] + d[1])
            if d == (0, 0) or not (0 <= q[0] <= n and 0 <= q[1] <= n):
                continue
            scale = 2 // (d[0] * d[0] + d[1] * d[1])
            for a, b in itertools.product((0, 1), repeat=2):
                value = scale * d[a] * d[b]
                k[2 * place[p] + a][2 * place[p] + b] += value
                if q in place:
                    k[2 * place[p] + a][2 * place[q] + b] -= value
                elif q == middle:
                    coupling[2 * place[p] + a][b] -= value
    return k, coupling


def to_mp(x):
    mantissa, exponent = x.mid().man_exp()
    return mp.mpf(int(mantissa)) * mp.mpf(2) ** int(exponent)


def hankel(n, shifts, channel):
    k, coupling = mesh(n)
    size, half = len(k), arb(1) / 2
    beta = arb(2).sqrt()
    column = arb_mat(size, 1, [half * row[channel] for row in coupling])
    basis = []
    for j in range(shifts):
        s = arb(10) ** (arb(4 * j) / (shifts - 1) - 2)
        a = [[half * k[i][j] * (1 + beta * s) + (s * s if i == j else 0) for j in range(size)] for i in range(size)]
        x = arb_mat(a).solve(column)
        v = mp.matrix([to_mp(x[i, 0]) for i in range(size)])
        for _ in range(2):
            for q in basis:
                v = v - q * mp.fdot(q, v)
        basis.append(v / mp.sqrt(mp.fdot(v, v)))
    rows = [[(j, c) for j, c in enumerate(row) if c] for row in k]
    stretched = [mp.matrix([sum(q[j] * c for j, c in row) / 2 for row in rows]) for q in basis]
    reduced = mp.matrix(shifts, shifts)
    for i, j in itertools.product(range(shifts), repeat=2):
        reduced[i, j] = mp.fdot(basis[i], stretched[j])
    force = mp.matrix([mp.mpf(row[channel]) / 2 for row in coupling])
    w2, modes = mp.eigsy((reduced + reduced.T) / 2)
    phi = modes.T * mp.matrix([mp.fdot(q, force) for q in basis])
    b = to_mp(beta)
    gramian = mp.matrix(2 * shifts, 2 * shifts)
    for i, j in itertools.product(range(shifts), repeat=2):
        wi, wj = w2[i], w2[j]
        # A_i X + X A_j^T = -[[0, 0], [0, g]], A = [[0, 1], [-w, -b w]], X = [[y, x], [-x, z]].
        t = (wi - wj) / (b * (wi + wj))
        y = -phi[i] * phi[j] / ((wj - wi) * t - b * (wi + wj) * (wj + b * wj * t))
        x = t * y
        block = [[y, x], [-x, wj * y + b * wj * x]]
        for r, c in itertools.product((0, 1), repeat=2):
            gramian[2 * i + r, 2 * j + c] = block[r][c]
    values, vectors = mp.eigsy((gramian + gramian.T) / 2)
    kept = [i for i in range(2 * shifts) if values[i] > mp.mpf(10) ** -50]
    factor = mp.matrix(2 * shifts, len(kept))
    for column_, i in enumerate(kept):
        for row in range(2 * shifts):
            factor[row, column_] = vectors[row, i] * mp.sqrt(values[i])
    symmetriser = mp.matrix(2 * shifts, 2 * shifts)
    for i in range(shifts):
        symmetriser[2 * i, 2 * i + 1] = symmetriser[2 * i + 1, 2 * i] = 1
        symmetriser[2 * i + 1, 2 * i + 1] = b
    product = factor.T * symmetriser * factor
    return [abs(value) for value in mp.eigsy((product + product.T) / 2, eigvals_only=True)]


if __name__ == "__main__":
    shifts = int(sys.argv[1])
    cells = int(sys.argv[2]) if len(sys.argv) > 2 else 12
    values = sorted(hankel(cells, shifts, 0) + hankel(cells, shifts, 1), reverse=True)
    print(json.dumps([float(value) for value in values[:34]]))
