"""palpate: feel deformable bodies. SI units throughout; the unit is in the name."""

from collections.abc import Mapping, Sequence
from os import PathLike
from types import TracebackType
from typing import Any, Literal, Self, final

import numpy as np
import numpy.typing as npt
import pandas

from . import errors as errors
from . import typing as typing
from .errors import DeviceError as DeviceError
from .errors import Error as Error
from .errors import FaultError as FaultError
from .errors import FileError as FileError
from .errors import LogError as LogError
from .errors import RefusedError as RefusedError
from .errors import SceneError as SceneError
from .errors import UsageError as UsageError
from .typing import Body, Device, Floats, Ids, Mesh, Vector

__all__ = [
    "Block",
    "Capsule",
    "DeviceError",
    "Error",
    "FaultError",
    "FileError",
    "Live",
    "LogError",
    "Point",
    "RefusedError",
    "Run",
    "Scene",
    "SceneError",
    "Session",
    "Sphere",
    "Table",
    "Tetrahedra",
    "UsageError",
    "__version__",
    "compare",
    "errors",
    "read",
    "reduce",
    "typing",
]

__version__: str

_Path = str | PathLike[str]
_Model = Literal[
    "auto", "full", "hold", "patch", "linear_boundary", "scaled_boundary", "condensed", "predicted", "predictive"
]
_Node = int | tuple[int, int, int] | Sequence[int]

@final
class Point:
    """A tool that is a point: one contact, with a single triangle."""

    def __new__(cls) -> Self: ...

@final
class Sphere:
    """A sphere: radius_m (m), from 0.1 mm to 1 m."""

    def __new__(cls, radius_m: float) -> Self: ...
    @property
    def radius_m(self) -> float: ...

@final
class Capsule:
    """A cylinder with a half sphere at both ends: radius_m (m), length_m between their centres (m), axis in the tool's own axes."""

    def __new__(cls, radius_m: float, length_m: float, axis: tuple[float, float, float] = ...) -> Self: ...
    @property
    def radius_m(self) -> float: ...
    @property
    def length_m(self) -> float: ...
    @property
    def axis(self) -> tuple[float, float, float]: ...

@final
class Block:
    """A block of point masses, each joined by springs to its 26 neighbours. Node id = i + nx (j + ny k)."""

    def __new__(
        cls,
        nodes: Sequence[int],
        size_m: Vector,
        *,
        stiffness_n_per_m: float = 30.0,
        damping_ratio: float = 0.3,
        node_mass_kg: float = 0.0005,
        fixed: Sequence[str] | None = None,
        regions: Sequence[Mapping[str, Any]] | None = None,
    ) -> Self: ...
    @property
    def nodes(self) -> Floats:
        """Rest positions (m), shape (n, 3)."""
    @property
    def triangles(self) -> Ids:
        """Nodes of each surface triangle, counter-clockwise seen from outside, shape (m, 3)."""
    @property
    def held(self) -> npt.NDArray[np.bool_]:
        """Whether each node is held, shape (n,)."""

@final
class Tetrahedra:
    """Linear tetrahedra with tissue's own parameters: a volume mesh as a file or arrays, or a closed surface that is filled."""

    def __new__(
        cls,
        mesh: _Path | tuple[npt.ArrayLike, npt.ArrayLike] | Mesh,
        *,
        young_modulus_pa: float,
        poisson_ratio: float,
        density_kg_m3: float = 1060.0,
        viscosity_pa_s: float = 0.0,
        nodal_pressure: bool = True,
        fixed: Sequence[str | Mapping[str, Any]] | None = None,
        regions: Sequence[Mapping[str, Any]] | None = None,
        groups: Mapping[str, npt.ArrayLike] | None = None,
        element_size_m: float | None = None,
        surface_size_m: float | None = None,
        unit_m: float | None = None,
    ) -> Self: ...
    @property
    def nodes(self) -> Floats:
        """Rest positions (m), shape (n, 3)."""
    @property
    def triangles(self) -> Ids:
        """Nodes of each surface triangle, counter-clockwise seen from outside, shape (m, 3)."""
    @property
    def tetrahedra(self) -> Ids:
        """Nodes of each element, shape (k, 4)."""
    @property
    def groups(self) -> dict[str, Ids]:
        """The nodes of each named group of the mesh."""
    @property
    def held(self) -> npt.NDArray[np.bool_]:
        """Whether each node is held, shape (n,)."""

@final
class Scene:
    """Everything that a run needs to know, from a scene file or a dictionary of the same tables."""

    def __new__(cls, source: _Path | dict[str, Any], base: _Path | None = None) -> Self: ...
    @staticmethod
    def demo() -> Scene: ...
    def to_dict(self) -> dict[str, Any]: ...
    @property
    def base(self) -> str | None: ...

_Subject = Scene | _Path | dict[str, Any]

@final
class Session:
    """A body, a tool, and what moves it."""

    def __new__(
        cls,
        subject: Block | Tetrahedra | _Subject | Body,
        *,
        tool: Point | Sphere | Capsule | None = None,
        path: _Path | npt.ArrayLike | None = None,
        device: Device | None = None,
        attach_node: _Node | None = None,
        model: _Model | None = None,
        friction: float | Literal["stick"] | None = None,
        error_pct: float | None = None,
        patch: Sequence[int] | None = None,
        basis: int | None = None,
        crossfade_ms: float | None = None,
        probes: Sequence[_Node] | None = None,
        duration_s: float | None = None,
        rate_hz: float | None = None,
        global_rate_hz: float | None = None,
        settings: dict[str, Any] | None = None,
    ) -> Self: ...
    def run(self, *, log: _Path | None = None, log_scene: bool = False) -> Run:
        """Runs it in simulated time: bit for bit the same every time."""
    def start(self, *, log: _Path | None = None, log_scene: bool = False, endless: bool = False) -> Live:
        """Starts it in real time, on threads of its own."""
    def choice(self) -> str | None:
        """The local model that would be chosen and why; None if one was named."""
    def plan(self) -> str:
        """The schedule in real time, and what this system would refuse."""

@final
class Live:
    """A session that runs in real time. As a context manager it stops the session at the end of the block."""

    def wait(self, seconds: float | None = None) -> None: ...
    def view(
        self, *, seconds: float | None = None, port: int = 0, listen: str | None = None, open: bool = True
    ) -> str: ...
    def now(self) -> dict[str, Any]: ...
    def point(self, place: Vector) -> None: ...
    def stop(self) -> Run: ...
    @property
    def elapsed(self) -> float | None: ...
    @property
    def finished(self) -> bool: ...
    def __enter__(self) -> Live: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...

@final
class Table:
    """A topic of a run: read-only columns of shape (rows,), with the names and units of `palpate export`."""

    @property
    def columns(self) -> list[str]: ...
    def keys(self) -> list[str]: ...
    def __getitem__(self, name: str, /) -> npt.NDArray[Any]: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __len__(self) -> int: ...
    def to_pandas(self) -> pandas.DataFrame: ...

@final
class Run:
    """A run that is over, or its log. One row is one haptic tick, n of them; arrays are read-only views."""

    @property
    def time(self) -> Floats:
        """End of each tick (s), shape (n,)."""
    @property
    def force(self) -> Floats:
        """Force on the tool (N), the mean over each tick, before the safety pipeline, shape (n, 3)."""
    @property
    def commanded(self) -> Floats:
        """Force that the device was commanded (N), shape (n, 3)."""
    @property
    def torque(self) -> Floats | None:
        """Torque about the tool's centre (N m), shape (n, 3); None if there was none."""
    @property
    def tool(self) -> Floats:
        """Position of the tool at the end of each tick (m), shape (n, 3)."""
    @property
    def velocity(self) -> Floats:
        """Velocity of the tool (m/s), shape (n, 3)."""
    @property
    def orientation(self) -> Floats | None:
        """Turn of the tool as a quaternion (w, x, y, z), shape (n, 4); None if it was never turned."""
    @property
    def contacts(self) -> Table: ...
    @property
    def contact_points(self) -> Table: ...
    @property
    def resyncs(self) -> Table: ...
    @property
    def timing(self) -> dict[str, Table]: ...
    @property
    def topics(self) -> list[str]: ...
    def __getitem__(self, topic: str, /) -> Table: ...
    @property
    def devices(self) -> list[str]: ...
    def device(self, name: str) -> Run: ...
    @property
    def model(self) -> str | None: ...
    @property
    def environment(self) -> dict[str, Any]: ...
    @property
    def report(self) -> str: ...
    @property
    def faults(self) -> list[str]: ...
    @property
    def damage(self) -> str | None: ...
    def to_pandas(self, topic: str | None = None) -> pandas.DataFrame: ...
    def __len__(self) -> int: ...

def read(path: _Path) -> Run:
    """Reads a log of palpate's (MCAP): the run that it holds."""

def compare(
    subject: _Subject | Session,
    *,
    models: Sequence[_Model] | None = None,
    latencies_ms: Sequence[float] | None = None,
    duration_s: float | None = None,
    finer: bool = False,
) -> dict[str, Any]:
    """Each local model in simulated time against "full": what `palpate compare --json` prints."""

def reduce(
    subject: _Subject | Session,
    *,
    patch: Sequence[int] | None = None,
    node: _Node | None = None,
    every: int | None = None,
    error_pct: float | None = None,
    order: int | None = None,
    measure: bool = False,
) -> dict[str, Any]:
    """Where the local model of a scene may be trusted: what `palpate reduce --json` prints."""
