"""Arrays are frozen, and views of memory that Rust made."""

import gc

import numpy as np
import palpate
import pytest


@pytest.fixture(scope="module")
def run(block, press):
    return palpate.Session(block, path=press, model="patch").run()


def test_shapes_and_times(run):
    ticks = 250
    assert len(run) == ticks
    assert run.force.shape == run.tool.shape == run.velocity.shape == run.commanded.shape == (ticks, 3)
    assert np.allclose(run.time, np.arange(1, ticks + 1) * 1e-3)
    assert run.orientation is None and run.torque is None
    # The force is that of the tick which ends where the tool is then.
    assert run.tool[99] == pytest.approx([0.031, 0.029, 0.054])
    assert run.force[99, 2] > 0.1 and (run.force[:20] == 0).all()
    assert set(run.contacts["mode"]) >= {"free", "slip"}
    assert len(run.timing["local"]) == ticks + 1 and len(run.resyncs) == 7


@pytest.mark.parametrize("name", ["force", "tool", "velocity", "time", "commanded"])
def test_nobody_writes_to_an_array(run, name):
    array = getattr(run, name)
    with pytest.raises(ValueError):
        array[0] = 1.0
    with pytest.raises(ValueError):
        array.setflags(write=True)


def test_nothing_is_copied(run, block):
    assert np.may_share_memory(run.force, run.time), "one block of memory, as the table has it"
    assert np.shares_memory(run.force, run["/force"]["fx_n"]) and run.force.base is not None
    assert np.shares_memory(run.tool, run["/tool"]["x_m"])
    for array in (block.nodes, block.triangles):
        assert not array.flags.writeable


def test_an_array_outlives_its_run(block, press):
    force = palpate.Session(block, path=press, model="hold", duration_s=0.1).run().force
    gc.collect()
    assert np.isfinite(force).all() and force.shape == (100, 3)


def test_a_table_is_a_mapping(run):
    table = run.resyncs
    assert list(dict(table)) == table.columns and "t_s" in table and len(table) == len(table["t_s"])
    with pytest.raises(KeyError, match="the columns are t_s"):
        table["force"]
    with pytest.raises(KeyError, match="/force_commanded"):
        run["/forces"]


def test_pandas(run, tmp_path):
    frame = run.to_pandas()
    assert (frame[["fx_n", "fy_n", "fz_n"]].to_numpy() == run.force).all() and frame.index.name == "t_s"
    assert list(frame["mode"]) == list(run.contacts["mode"])
    assert list(run.to_pandas("/resync").columns) == run.resyncs.columns
