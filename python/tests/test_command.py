"""What the package computes and reads is what the command computes and prints, bit for bit."""

import numpy as np
import palpate
import pytest

FORCE = ["fx_n", "fy_n", "fz_n"]


def equal(ours, theirs):
    """Equal in every bit, and -0.0 is not 0.0."""
    ours, theirs = np.ascontiguousarray(ours, "f8"), np.ascontiguousarray(theirs, "f8")
    assert ours.shape == theirs.shape
    return (ours.view("u8") == theirs.view("u8")).all()


@pytest.mark.parametrize(
    "name, seconds", [("drag_friction", 1.0), ("demo", 0.5), ("finger", 0.6), ("liver_tumour", 0.4), ("hand", 0.5), ("two_hands", 1.0)]
)
def test_a_run_has_the_forces_of_the_command(command, scenes, tmp_path, name, seconds):
    scene, log = scenes / f"{name}.toml", tmp_path / "command.mcap"
    command("run", scene, "--virtual", "--duration", seconds, "--out", log)
    run = palpate.Session(scene, duration_s=seconds).run()
    for device in run.devices or [None]:
        ours, prefix = (run.device(device), f"/{device}") if device else (run, "")
        assert equal(ours.force, command.numbers(log, f"{prefix}/force", FORCE)) and np.abs(run.force).max() > 0
        commanded = ours[f"{prefix}/force_commanded"]
        assert equal(np.stack([commanded[name] for name in FORCE], 1), command.numbers(log, f"{prefix}/force_commanded", FORCE))
        assert equal(ours.time, command.numbers(log, f"{prefix}/force", ["t_s"])[:, 0])


@pytest.mark.parametrize("model", ["full", "hold", "patch", "predictive"])
def test_a_model_has_the_forces_of_the_command(command, scenes, tmp_path, model):
    scene, log = scenes / "drag_friction.toml", tmp_path / "command.mcap"
    command("run", scene, "--virtual", "--duration", 0.8, "--model", model, "--out", log)
    run = palpate.Session(scene, model=model, duration_s=0.8).run()
    assert equal(run.force, command.numbers(log, "/force", FORCE)) and np.abs(run.force).max() > 0


def test_a_log_is_read_as_the_command_exports_it(command, scenes, tmp_path):
    log = tmp_path / "ours.mcap"
    run = palpate.Session(scenes / "finger.toml", duration_s=0.7).run(log=log)
    read = palpate.read(log)
    for topic in read.topics:
        ours, theirs = read[topic], command.table(log, topic)
        assert ours.columns == list(theirs), topic
        for name in ours.columns:
            column, cells = ours[name], theirs[name]
            if column.dtype.kind == "U":
                assert list(column) == [cell.strip('"') for cell in cells], (topic, name)
            elif column.dtype.kind == "i":
                assert [("" if n < 0 else str(n)) for n in column] == list(cells), (topic, name)
            elif column.dtype.kind == "u":
                assert column.tolist() == [int(cell) for cell in cells], (topic, name)
            else:
                assert (column == np.array(cells, column.dtype)).all(), (topic, name)
        if topic in run.topics:
            memory = run[topic]
            assert memory.columns == ours.columns
            for name in ours.columns:
                assert (memory[name] == ours[name]).all(), (topic, name)
    assert len(read.contact_points) > 0 and len(read.resyncs) > 0
