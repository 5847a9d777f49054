"""Two elastic bodies by quadratic tetrahedra, independent of this project's code: python quadratic.py [> quadratic.json]

Needs numpy, scipy and pypardiso. Linear elasticity of small strains, ten-node tetrahedra, meshes graded towards the clamped face
and the edges, and four of them, so that what is left is extrapolated (Richardson, with the order that the last three show). `deflection_m` is
the mean over the loaded face, in the direction of the load: the work of the load over the load.

cantilever: 0.1 x 0.02 x 0.02 m, clamped at x = 0, sheared along z at x = 0.1; a quarter is computed (even in y, odd in z).
cook: Cook's membrane in 3D, corners (0, 0), (48, 44), (48, 60), (0, 44) mm, 10 mm thick, sides free (neither plane strain nor plane
stress), clamped at x = 0, sheared along y at x = 48 mm; half of it is computed (even in z).
"""

import datetime
import importlib.metadata
import itertools
import json
import sys

import numpy as np
import scipy.sparse as sparse
from pypardiso import PyPardisoSolver

YOUNG, LOAD = 5000.0, 1e-5
RATIOS, SIZES = [0.3, 0.45, 0.49], [2, 3, 4, 6]
EDGES = list(itertools.combinations(range(4), 2))
# Four points that integrate products of two linear functions exactly.
A, B = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
POINTS = np.full((4, 4), B) + (A - B) * np.eye(4)


def lattice(cells):
    """Corners and edge middles of cells split into six, as coordinates on the lattice of half cells."""
    cubes = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), -1).reshape(-1, 3)
    corners = []
    for order in itertools.permutations(range(3)):
        steps = np.zeros((4, 3), int)
        for i, axis in enumerate(order):
            steps[i + 1 :, axis] = 1
        corners.append(cubes[:, None] + steps)
    corners = np.concatenate(corners)
    middles = np.stack([corners[:, a] + corners[:, b] for a, b in EDGES], 1)
    return corners, np.concatenate([2 * corners, middles], 1)


def stiffness(elements, positions, ratio):
    """Sparse K, its upper half, of quadratic tetrahedra with straight edges; `positions` of their four corners."""
    d = (positions[:, 1:] - positions[:, :1]).transpose(0, 2, 1)
    volume = np.abs(np.linalg.det(d)) / 6
    inner = np.linalg.inv(d)
    slopes = np.concatenate([-inner.sum(1, keepdims=True), inner], 1)
    shear, lame = YOUNG / (2 * (1 + ratio)), YOUNG * ratio / ((1 + ratio) * (1 - 2 * ratio))
    k = np.zeros((len(elements), 10, 3, 10, 3))
    for l in POINTS:
        corner = (4 * l - 1)[None, :, None] * slopes
        middle = np.stack([4 * (l[a] * slopes[:, b] + l[b] * slopes[:, a]) for a, b in EDGES], 1)
        g = np.concatenate([corner, middle], 1)
        w = volume / 4
        k += lame * np.einsum("e,eai,ebj->eaibj", w, g, g)
        k += shear * np.einsum("e,eaj,ebi->eaibj", w, g, g)
        k += shear * np.einsum("e,eak,ebk,ij->eaibj", w, g, g, np.eye(3), optimize=True)
    dofs = (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), 30).astype(np.int32)
    rows, columns = np.repeat(dofs, 30, 1).ravel(), np.tile(dofs, (1, 30)).ravel()
    upper = rows <= columns
    size = 3 * (elements.max() + 1)
    return sparse.csr_matrix((k.ravel()[upper], (rows[upper], columns[upper])), (size, size))


def solve(cells, place, held, loaded, direction, share, ratio):
    """Mean deflection of the face x = last under `share` of the load."""
    corners, nodes = lattice(cells)
    counts = 2 * np.array(cells) + 1
    number = lambda at: np.ravel_multi_index(np.moveaxis(at, -1, 0), counts)
    elements = number(nodes)
    positions = place(corners / np.array(cells))
    k = stiffness(elements, positions, ratio)
    at = np.stack(np.unravel_index(np.arange(counts.prod()), counts), -1)
    fixed = held(at, counts).ravel()

    # A uniform load on quadratic triangles is a third of it at each middle of an edge.
    force = np.zeros(3 * len(at))
    last = counts[0] - 1
    for face in itertools.combinations(range(4), 3):
        on = (nodes[:, face, 0] == last).all(1)
        a, b, c = (positions[on, i] for i in face)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        for pair in itertools.combinations(face, 2):
            np.add.at(force, 3 * elements[on, 4 + EDGES.index(pair)] + direction, area / 3)
    force *= share * LOAD / force.sum()

    free = np.flatnonzero(~fixed)
    solver = PyPardisoSolver(mtype=2)
    u = np.zeros_like(force)
    u[free] = solver.solve(sparse.csr_matrix(k[free][:, free]), force[free])
    solver.free_memory(everything=True)
    return len(free), force @ u / (share * LOAD)


def cantilever(k, ratio):
    def place(s):
        graded = 1 - (1 - s[..., 1:]) ** 1.5
        return np.concatenate([0.1 * s[..., :1] ** 1.5, 0.01 * graded], -1)

    def held(at, _):
        fixed = np.repeat(at[:, :1] == 0, 3, 1)
        fixed[at[:, 1] == 0, 1] = True
        fixed[at[:, 2] == 0, :2] = True
        return fixed

    return solve((8 * k, 2 * k, 2 * k), place, held, 0, 2, 0.25, ratio)


def cook(k, ratio):
    def place(s):
        x, t = s[..., 0] ** 1.5, s[..., 1]
        t = np.where(t < 0.5, 0.5 * (2 * t) ** 1.5, 1 - 0.5 * (2 - 2 * t).clip(0) ** 1.5)
        low, high = 44 * x, 44 + 16 * x
        z = 5 * (1 - (1 - s[..., 2]) ** 1.5)
        return 1e-3 * np.stack([48 * x, low + (high - low) * t, z], -1)

    def held(at, _):
        fixed = np.repeat(at[:, :1] == 0, 3, 1)
        fixed[at[:, 2] == 0, 2] = True
        return fixed

    return solve((6 * k, 6 * k, k), place, held, 0, 1, 0.5, ratio)


def richardson(sizes, values):
    """The limit of the last three values, which differ by c h^p, and p."""
    h, v = 1 / np.array(sizes[-3:], float), np.array(values[-3:])
    target = (v[1] - v[0]) / (v[2] - v[1])
    ps = np.linspace(0.5, 6, 5501)
    p = ps[np.argmin(np.abs((h[0] ** ps - h[1] ** ps) / (h[1] ** ps - h[2] ** ps) - target))]
    return v[2] + (v[2] - v[1]) * h[2] ** p / (h[1] ** p - h[2] ** p), p


def main():
    packages = ["numpy", "scipy", "pypardiso"]
    result = {
        "date": str(datetime.date.today()),
        "versions": {"python": sys.version.split()[0], **{p: importlib.metadata.version(p) for p in packages}},
        "young_modulus_pa": YOUNG,
        "load_n": LOAD,
        "cases": [],
    }
    for body, ratios in [(cantilever, [0.0, *RATIOS]), (cook, RATIOS)]:
        for ratio in ratios:
            runs = [body(k, ratio) for k in SIZES]
            values = [value for _, value in runs]
            limit, order = richardson(SIZES, values)
            case = {
                "body": body.__name__,
                "poisson_ratio": ratio,
                "unknowns": [n for n, _ in runs],
                "computed_m": list(map(float, values)),
                "order": round(float(order), 2),
                "deflection_m": float(limit),
                "finest_off_pct": round(float(100 * (1 - values[-1] / limit)), 3),
            }
            if body is cantilever:
                # Of a shear load at the end of a square beam, with Cowper's shear coefficient.
                inertia, area, shear = 0.02**4 / 12, 0.02**2, YOUNG / (2 * (1 + ratio))
                case["euler_bernoulli_m"] = LOAD * 0.1**3 / (3 * YOUNG * inertia)
                cowper = 10 * (1 + ratio) / (12 + 11 * ratio)
                case["timoshenko_m"] = case["euler_bernoulli_m"] + LOAD * 0.1 / (cowper * shear * area)
            print(case, file=sys.stderr)
            result["cases"].append(case)
    json.dump(result, sys.stdout, indent=1)
    print()


main()
