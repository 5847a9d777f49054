"""Devices and bodies that are written in Python."""

import numpy as np
import palpate
import pytest


class Hand:
    """Follows a path and notes what it feels."""

    max_force_n = 5.0

    def __init__(self, path):
        self.path = np.array(path)
        self.felt = []

    def read(self, time_s):
        return [np.interp(time_s, self.path[:, 0], self.path[:, axis]) for axis in (1, 2, 3)]

    def write(self, force):
        assert force.shape == (3,)
        self.felt.append(force)


def test_a_device_moves_the_tool_and_feels_the_commanded_force(block, press):
    hand = Hand(press)
    run = palpate.Session(block, device=hand, model="patch", duration_s=0.25).run()
    scripted = palpate.Session(block, path=press, model="patch").run()
    assert np.allclose(run.tool, scripted.tool, atol=1e-12) and np.abs(run.force - scripted.force).max() < 1e-6
    felt = np.array(hand.felt)
    assert (felt[: len(run)] == run.commanded).all() and np.abs(run.force).max() > 0.1
    assert (felt[-1] == 0.0).all(), "nothing stays on the device"


def test_a_run_with_a_device_is_the_same_every_time(block, press):
    first, second = (palpate.Session(block, device=Hand(press), model="patch", duration_s=0.2).run() for _ in range(2))
    assert (first.force == second.force).all()


def test_the_velocity_is_told_or_that_of_the_way(block):
    class Telling:
        def read(self, time_s):
            return (0.03, 0.03, 0.08 - 0.1 * time_s), (0.0, 0.0, -0.1)

    class Silent:
        def read(self, time_s):
            return 0.03, 0.03, 0.08 - 0.1 * time_s

    told, silent = (palpate.Session(block, device=device, model="hold", duration_s=0.05).run() for device in (Telling(), Silent()))
    assert (told.velocity == [0.0, 0.0, -0.1]).all() and np.allclose(silent.velocity, told.velocity)


def test_an_exception_of_a_device_comes_out_of_the_run(block):
    class Breaks:
        def read(self, time_s):
            if time_s > 0.03:
                raise LookupError("the cable is out")
            return 0.03, 0.03, 0.08

    with pytest.raises(LookupError, match="the cable is out"):
        palpate.Session(block, device=Breaks(), model="hold", duration_s=1.0).run()

    class Lies:
        def read(self, time_s):
            return "here"

    with pytest.raises(TypeError, match="must give a position"):
        palpate.Session(block, device=Lies(), model="hold", duration_s=1.0).run()
    with pytest.raises(TypeError, match=r"needs a method read\(time\)"):
        palpate.Session(block, device=object())


class Net:
    """A square membrane of springs, held at its rim: the simplest body there is."""

    stiffness, damping = 40.0, 0.05

    def __init__(self, side=9, size=0.08):
        line = np.linspace(0.0, size, side)
        x, y = np.meshgrid(line, line, indexing="ij")
        self.nodes = np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1)
        number = np.arange(side * side).reshape(side, side)
        rim = np.zeros((side, side), bool)
        rim[[0, -1], :] = rim[:, [0, -1]] = True
        self.inverse_masses = np.where(rim.ravel(), 0.0, 1.0 / 0.5e-3)
        a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
        self.triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        pairs = [(number[:-1, :], number[1:, :]), (number[:, :-1], number[:, 1:]), (number[:-1, :-1], number[1:, 1:])]
        self.a, self.b = (np.concatenate([pair[end].ravel() for pair in pairs]) for end in (0, 1))
        # Taut: rest lengths below the distances.
        self.rest = 0.8 * np.linalg.norm(self.nodes[self.b] - self.nodes[self.a], axis=1)
        self.calls = 0

    def _spring_forces(self, x, v):
        along, closing = x[self.b] - x[self.a], v[self.b] - v[self.a]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        unit = along / length
        pull = self.stiffness * (length - self.rest[:, None]) + self.damping * (closing * unit).sum(1, keepdims=True)
        return pull * unit

    def forces(self, x, v):
        assert not x.flags.writeable and x.shape == v.shape
        self.calls += 1
        out, pull = np.zeros_like(x), self._spring_forces(x, v)
        np.add.at(out, self.a, pull)
        np.add.at(out, self.b, -pull)
        return out


class TautNet(Net):
    """With its tangent: good for every local model that keeps a patch."""

    def tangent(self, x, v, nodes, clamp):
        along = x[self.b] - x[self.a]
        length = np.linalg.norm(along, axis=1)
        unit = along / length[:, None]
        outer = unit[:, :, None] * unit[:, None, :]
        tension = self.stiffness * (1.0 - self.rest / length)
        if clamp:
            tension = np.maximum(tension, 0.0)
        k = self.stiffness * outer + tension[:, None, None] * (np.eye(3) - outer)
        c = self.damping * outer
        rows = np.concatenate([self.a, self.a, self.b, self.b])
        columns = np.concatenate([self.b, self.a, self.a, self.b])
        stiffness, damping = (np.concatenate([m, -m, m, -m]) for m in (k, c))
        chosen = np.isin(rows, nodes)
        return rows[chosen], columns[chosen], stiffness[chosen], damping[chosen]


DOWN = [(0.0, 0.041, 0.039, 0.002), (0.1, 0.041, 0.039, -0.006), (0.2, 0.041, 0.039, -0.006)]


def test_a_body_is_pressed():
    net = Net()
    run = palpate.Session(net, path=DOWN, model="full").run()
    assert run.model == "full" and net.calls > 200
    assert run.force[-1, 2] > 0.05 and (run.force[:20] == 0).all()
    again = palpate.Session(Net(), path=DOWN, model="full").run()
    assert (run.force == again.force).all()


def test_a_patch_of_a_body_is_near_the_whole():
    full = palpate.Session(TautNet(), path=DOWN, model="full").run()
    patch = palpate.Session(TautNet(), path=DOWN, model="patch").run()
    peak = np.abs(full.force).max()
    assert np.abs(patch.force - full.force).max() < 0.5 * peak and len(patch.resyncs) > 3


@pytest.mark.parametrize("model", ["hold", "linear_boundary", "scaled_boundary"])
def test_the_other_models_of_a_body_run(model):
    run = palpate.Session(TautNet(), path=DOWN, model=model).run()
    assert run.model == model and run.force[-1, 2] > 0.05


@pytest.mark.parametrize("model", ["condensed", "predicted", "predictive"])
def test_a_body_that_cannot_be_taken_apart_is_refused_where_it_must_be(model):
    with pytest.raises(palpate.SceneError, match="restriction") as caught:
        palpate.Session(TautNet(), path=DOWN, model=model).run()
    assert caught.value.field == "local.model"


def test_a_body_behind_a_link_is_refused_by_its_field():
    with pytest.raises(palpate.SceneError) as caught:
        palpate.Session(TautNet(), path=DOWN, model="hold", settings={"link": {"delay_ms": 1.0}}).run()
    assert caught.value.field == "link" and caught.value.file is None


def test_a_body_without_a_tangent_has_no_local_model():
    with pytest.raises(palpate.UsageError, match="model=\"full\"") as caught:
        palpate.Session(Net(), path=DOWN, model="patch")
    assert caught.value.field == "model"


def test_an_exception_of_a_body_comes_out_of_the_run():
    class Tears(Net):
        def forces(self, x, v):
            if self.calls > 400:
                raise ArithmeticError("it tears")
            return super().forces(x, v)

    with pytest.raises(ArithmeticError, match="it tears"):
        palpate.Session(Tears(), path=DOWN, model="full").run()

    class Wrong(Net):
        def forces(self, x, v):
            return np.zeros((3, 3))

    with pytest.raises(ValueError, match="must be an array of shape"):
        palpate.Session(Wrong(), path=DOWN, model="full").run()


@pytest.mark.parametrize("part", ["device", "body"])
def test_nothing_of_python_is_let_on_a_real_time_thread(block, press, part):
    session = (
        palpate.Session(block, device=Hand(press), duration_s=0.1)
        if part == "device"
        else palpate.Session(Net(), path=DOWN, model="full")
    )
    with pytest.raises(palpate.UsageError, match="is written in Python"):
        session.start()


def test_a_body_that_explodes_is_a_fault_with_what_came_before():
    class Explodes(Net):
        def forces(self, x, v):
            return super().forces(x, v) * (np.nan if x[:, 2].min() < -0.003 else 1.0)

    with pytest.raises(palpate.FaultError) as caught:
        palpate.Session(Explodes(), path=DOWN, model="full").run()
    run = caught.value.run
    assert run.faults and str(caught.value).endswith(run.faults[0])
    assert 50 < len(run) < 200
    # The record has what was computed in the tick of the fault; the device never gets it.
    before, last = run.force[:-1], run.force[-1]
    assert np.isfinite(before).all() and before[:, 2].max() > 0.01 and np.isnan(last).any()
    assert np.isfinite(run.commanded).all()
