"""Errors: what is wrong, where, and what would be right.

Every error of palpate is an :class:`Error`. ``str(error)`` is one line; its parts are ``error.place`` (where, as the engine says it),
``error.field`` (the dotted key of a scene, such as ``"body.block.nodes"``, or the name of an argument), ``error.file`` and ``error.line``
(of a scene file, a path or a mesh), and ``error.remedy`` (what is wrong and what would be right). What is not known is ``None``.
"""

import re

_LINE = re.compile(r"(?P<file>.+):(?P<line>\d+)")
_FIELD = re.compile(r"(body|contact|global|local|link|device|safety|initial|probe|log|run)(\[\d+\])?(\.[A-Za-z_\[\]0-9]+)*")


class Error(Exception):
    """What palpate refuses, or what went wrong."""

    place: "str | None"
    field: "str | None"
    file: "str | None"
    line: "int | None"
    remedy: str

    def __init__(self, place: str, remedy: str, field: "str | None" = None) -> None:
        super().__init__(f"{place}: {remedy}" if place else remedy)
        self.place = place or None
        self.remedy = remedy
        self.file = self.line = None
        self.field = field
        for piece in place.split(": "):
            line = _LINE.fullmatch(piece)
            if line:
                self.file, self.line = line["file"], int(line["line"])
            elif _FIELD.fullmatch(piece) or self.line is not None:
                self.field = self.field or piece
            elif piece and piece != self.field and self.file is None:
                self.file = piece

    def __str__(self) -> str:
        return self.args[0]

    def __reduce__(self):
        return type(self), (self.place or "", self.remedy, self.field), self.__dict__


class SceneError(Error, ValueError):
    """A scene, or an argument that stands for a part of it, cannot work. ``field`` names it."""


class UsageError(Error, ValueError):
    """An argument of a call is unusable. ``field`` is its name."""

    def __init__(self, place: str, remedy: str, field: "str | None" = None) -> None:
        super().__init__(place, remedy, field or place or None)


class FileError(Error, OSError):
    """A file could not be read or written."""


class LogError(Error, ValueError):
    """A file is no log, or does not hold what was asked for."""


class DeviceError(Error, RuntimeError):
    """A device refused a call or vanished."""


class RefusedError(Error, RuntimeError):
    """The runtime refused a session, or could not start it."""


class FaultError(Error, RuntimeError):
    """A run ended in a fault. ``run`` is what it did until then; None if nothing is left of it."""

    run: "object | None" = None
