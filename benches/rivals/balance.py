"""Balanced truncation against SLICOT's AB09AD: python benches/rivals/balance.py [CELLS] [ROUNDS]

Needs numpy and slycot, and the bench `reduction` built: both take turns on one core in one invocation. CELLS = 20 is the paper's mesh of 1,516
states, which the dense method of SLICOT reduces to 20 as palpate does.
"""

import json
import os
import statistics
import subprocess
import sys
import time

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import itertools

import numpy as np
import slycot


def mesh(n, k=100.0, m=1e-3, zeta=1.0):
    """A, B, C of the paper's n x n mesh in the reading of physics: displacement of the top's middle in, force out."""
    nodes = list(itertools.product(range(n + 1), repeat=2))
    middle = ((n + 1) // 2, n)
    free = [p for p in nodes if 0 < p[0] < n and p[1] > 0 and p != middle]
    place = {p: i for i, p in enumerate(free)}
    size = 2 * len(free)
    stiffness, coupling = np.zeros((size, size)), np.zeros((size, 2))
    for p in free:
        for d in itertools.product((-1, 0, 1), repeat=2):
            q = (p[0] + d[0], p[1] + d[1])
            if d == (0, 0) or not (0 <= q[0] <= n and 0 <= q[1] <= n):
                continue
            block = k * np.outer(d, d) / np.dot(d, d)
            row = slice(2 * place[p], 2 * place[p] + 2)
            stiffness[row, row] += block
            if q in place:
                stiffness[row, 2 * place[q] : 2 * place[q] + 2] -= block
            elif q == middle:
                coupling[row] -= block
    beta, w = zeta * np.sqrt(2 * m * k) / k, np.sqrt(k / m)
    # States x and x'/w: nearer to each other in size.
    a = np.zeros((2 * size, 2 * size))
    a[:size, size:] = w * np.eye(size)
    a[size:, :size] = -stiffness / (m * w)
    a[size:, size:] = -beta * stiffness / m
    b = np.vstack([np.zeros((size, 2)), -coupling / (m * w)])
    c = np.hstack([coupling.T, beta * w * coupling.T])
    return a, b, c


def main():
    cells = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 3
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    a, b, c = mesh(cells)
    ratios = {"dense": [], "low_rank": []}
    for _ in range(rounds):
        started = time.perf_counter()
        hankel = slycot.ab09ad("C", "B", "N", len(a), 2, 2, a.copy(), b.copy(), c.copy(), nr=20, tol=0.0)[4]
        slicot_s = time.perf_counter() - started
        error = 200 * hankel[20:].sum() / hankel.sum()
        command = ["cargo", "bench", "--quiet", "--bench", "reduction", "--", "--json", "--cells", str(cells)]
        ours = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        assert ours["order"] == len(a), "the same mesh"
        for name in ratios:
            ratios[name].append(slicot_s / ours[f"{name}_s"])
            assert abs(ours[f"{name}_pct"] / error - 1) < 0.01, "the same error"
        print(
            f"{len(a)} states: AB09AD {slicot_s:.2f} s, {error:.6f} %; "
            f"dense {ours['dense_s']:.3f} s, {ours['dense_pct']:.6f} %; "
            f"low rank {ours['low_rank_s']:.4f} s, {ours['low_rank_pct']:.6f} %"
        )
    for name, values in ratios.items():
        print(f"AB09AD over {name}: median {statistics.median(values):.0f}, least {min(values):.0f}")


main()
