"""What the package takes, as types: devices and bodies that are written in Python, arrays, vectors."""

from collections.abc import Sequence
from typing import Any, Protocol, Union

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ids = npt.NDArray[np.uint32]
Vector = Union[Sequence[float], Floats]
State = Union[Vector, "tuple[Vector, Vector]", "tuple[Vector, Vector, Vector]"]


class Mesh(Protocol):
    """A mesh of meshio or pyvista: points (n, 3) (m), and tetrahedra (k, 4) among the cells."""

    @property
    def points(self) -> npt.ArrayLike: ...

    @property
    def cells_dict(self) -> "dict[Any, Any]": ...


class Device(Protocol):
    """What moves the tool; for simulated time.

    ``read`` gives the position (m), or a tuple of position and velocity (m/s), or of those and a quaternion (w, x, y, z). Optional:
    ``write(force)``, which takes the commanded force (N), an array of shape (3,), and ``max_force_n``, what it can exert.
    """

    def read(self, time_s: float, /) -> State: ...


class Body(Protocol):
    """A deformable body of n nodes; for simulated time.

    ``nodes`` (n, 3) are rest positions (m), ``inverse_masses`` (n,) are 1/kg and zero for a node that is held, ``triangles`` (m, 3) are the
    surface, counter-clockwise seen from outside. ``forces`` gives the internal force on every node (N), shape (n, 3), linear in the
    velocities.

    Optional: ``node_forces(positions, velocities, nodes)``, shape (len(nodes), 3), and ``tangent(positions, velocities, nodes, clamp)``, a
    tuple (rows, columns, stiffness, damping) of shapes (k,), (k,), (k, 3, 3), (k, 3, 3): the derivatives of the force on ``rows``, among
    ``nodes``, by position (N/m) and velocity (N s/m) of ``columns``. Models other than "full" need the tangent.
    """

    @property
    def nodes(self) -> npt.ArrayLike: ...

    @property
    def inverse_masses(self) -> npt.ArrayLike: ...

    @property
    def triangles(self) -> npt.ArrayLike: ...

    def forces(self, positions: Floats, velocities: Floats, /) -> npt.ArrayLike: ...
