"""Checked by mypy, never run: how the package is used, with its types."""

from typing import assert_type

import numpy as np
import palpate


class Hand:
    def read(self, time_s: float) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.1 - time_s

    def write(self, force: palpate.typing.Floats) -> None:
        print(force[2])


def use() -> None:
    body = palpate.Tetrahedra("liver.msh", young_modulus_pa=5e3, poisson_ratio=0.45, fixed=["attached"])
    run = palpate.Session(body, tool=palpate.Sphere(0.004), path=np.zeros((2, 4)), model="predictive").run()
    assert_type(run, palpate.Run)
    print(run.force[:, 2].max(), run.resyncs["jump_after_n"].max(), run.timing["local"].to_pandas())
    palpate.Session(body, device=Hand(), friction="stick", duration_s=1.0).run(log="run.mcap")
    with palpate.Session({"body": {}}).start(log="run.mcap") as live:
        assert_type(live, palpate.Live)
        live.view()
    palpate.read("run.mcap").to_pandas()
    try:
        palpate.Scene("scene.toml")
    except palpate.SceneError as error:
        print(error.field, error.file, error.line, error.remedy)
    print(palpate.compare("scene.toml", models=["patch"])["models"], palpate.reduce("scene.toml")["locality"])
