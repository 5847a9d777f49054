"""palpate: feel deformable bodies. Sessions, logs and studies of the palpate engine, as numpy arrays.

    import palpate
    body = palpate.Block([12, 12, 12], [0.1, 0.1, 0.1])
    path = [(0.0, 0.05, 0.05, 0.11), (0.5, 0.05, 0.05, 0.09), (1.0, 0.05, 0.05, 0.11)]
    run = palpate.Session(body, path=path, model="predictive").run()
    run.force       # numpy, shape (ticks, 3), N

SI units throughout; the unit is in the name.
"""

from . import errors, typing
from ._palpate import (
    Block, Capsule, Live, Point, Run, Scene, Session, Sphere, Table, Tetrahedra, __version__, compare, read, reduce,
)
from .errors import DeviceError, Error, FaultError, FileError, LogError, RefusedError, SceneError, UsageError

__all__ = [
    "Block", "Capsule", "DeviceError", "Error", "FaultError", "FileError", "Live", "LogError", "Point", "RefusedError", "Run", "Scene",
    "SceneError", "Session", "Sphere", "Table", "Tetrahedra", "UsageError", "__version__", "compare", "errors", "read", "reduce", "typing",
]
