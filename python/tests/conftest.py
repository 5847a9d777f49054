"""What the tests share: the repository's scenes, and the command to compare with."""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def scenes():
    return ROOT / "scenes"


class Command:
    """The command `palpate`, of the same commit as the package: PALPATE_COMMAND names it, or the PATH has it."""

    def __init__(self, program):
        self.program = program

    def __call__(self, *arguments):
        return subprocess.run([self.program, *map(str, arguments)], check=True, capture_output=True, text=True).stdout

    def table(self, log, topic):
        """The columns of `palpate export`, read exactly."""
        header, *rows = self("export", log, "--topic", topic).splitlines()
        columns = zip(*(row.split(",") for row in rows)) if rows else [[] for _ in header.split(",")]
        return dict(zip(header.split(","), columns))

    def numbers(self, log, topic, names):
        table = self.table(log, topic)
        return np.array([[float(cell) for cell in table[name]] for name in names]).T


@pytest.fixture(scope="session")
def command():
    program = os.environ.get("PALPATE_COMMAND") or shutil.which("palpate")
    if not program:
        pytest.skip("there is no command to compare with: set PALPATE_COMMAND")
    return Command(program)


@pytest.fixture(scope="session")
def block():
    import palpate

    return palpate.Block([8, 8, 8], [0.06, 0.06, 0.06])


@pytest.fixture(scope="session")
def press():
    """Down onto the block's top, 6 mm in, and up: rows of time and place."""
    return [(0.0, 0.031, 0.029, 0.062), (0.1, 0.031, 0.029, 0.054), (0.2, 0.035, 0.029, 0.054), (0.25, 0.035, 0.029, 0.064)]
