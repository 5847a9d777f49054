"""Scenes from files and dictionaries, and the studies of them."""

import json
import os
import signal
import threading
import time

import numpy as np
import palpate
import pytest


def test_a_file_its_dictionary_and_parts_make_the_same_run(scenes):
    file = palpate.Scene(scenes / "liver_tumour.toml")
    dictionary = palpate.Scene(file.to_dict(), base=file.base)
    body = palpate.Tetrahedra(
        scenes / "meshes/liver.msh",
        young_modulus_pa=5e3,
        poisson_ratio=0.45,
        viscosity_pa_s=2.0,
        fixed=["attached"],
        regions=[{"group": "tumour", "young_modulus_pa": 5e4, "viscosity_pa_s": 5.0}],
    )
    assert body.tetrahedra.shape[1] == 4 and set(body.groups) >= {"attached", "tumour"}
    assert body.held[body.groups["attached"]].all()
    parts = dict(path=scenes / "paths/liver_slide.csv", friction=0.2, crossfade_ms=10.0, model="predictive")
    sessions = [
        palpate.Session(file, duration_s=0.3),
        palpate.Session(scenes / "liver_tumour.toml", duration_s=0.3),
        palpate.Session(dictionary, duration_s=0.3),
        palpate.Session(body, duration_s=0.3, **parts),
    ]
    first, *others = [session.run().force for session in sessions]
    assert np.abs(first).max() > 0.01
    for other in others:
        assert (first == other).all()


def test_a_session_changes_a_scene_and_leaves_it_alone(scenes):
    scene = palpate.Scene(scenes / "drag_friction.toml")
    frictionless = palpate.Session(scene, friction=0.0, duration_s=0.6, model="patch").run()
    rough = palpate.Session(scene, duration_s=0.6, model="patch").run()
    most = [run.contacts["tangential_force_n"].max() for run in (frictionless, rough)]
    assert most[0] < 0.05 * most[1] and most[1] > 0.01
    assert scene.to_dict()["contact"]["friction"] == pytest.approx(1.0)


def test_a_run_lasts_as_its_scene_says_or_to_the_end_of_the_path(block, press):
    material = {"stiffness_n_per_m": 30.0, "damping_ratio": 0.3, "node_mass_kg": 0.0005}
    body = {"body": {"kind": "mass_spring", "block": {"nodes": [8, 8, 8], "size_m": [0.06] * 3}, "material": material}}
    timed = {**body, "run": {"duration_s": 0.1}}
    for subject, keywords, ticks in [
        (block, {}, 250),
        (body, {}, 250),
        (palpate.Scene(body), {}, 250),
        (timed, {}, 100),
        (timed, {"duration_s": 0.05}, 50),
        (body, {"settings": {"run": {"duration_s": 0.05}}}, 50),
    ]:
        assert len(palpate.Session(subject, path=press, model="hold", **keywords).run()) == ticks


def test_a_sphere_turns_and_touches_at_many_places(block):
    path = [(0.0, 0.03, 0.03, 0.068, 1, 0, 0, 0), (0.2, 0.03, 0.03, 0.06, np.sqrt(0.5), 0, 0, np.sqrt(0.5))]
    run = palpate.Session(block, tool=palpate.Capsule(0.004, 0.02, (1, 0, 0)), path=path, model="full").run()
    assert run.orientation.shape == (200, 4) and np.allclose(np.linalg.norm(run.orientation, axis=1), 1.0)
    assert run.torque.shape == (200, 3) and len(run.contact_points) > 100


def test_arrays_make_the_mesh_that_a_file_does(scenes):
    tissue = dict(young_modulus_pa=5e3, poisson_ratio=0.45, fixed=["attached"])
    file = palpate.Tetrahedra(scenes / "meshes/liver.msh", **tissue)
    arrays = (file.nodes, file.tetrahedra)
    ours = palpate.Tetrahedra(arrays, groups={"attached": file.groups["attached"]}, **tissue)
    assert (ours.nodes == file.nodes).all() and (ours.held == file.held).all() and ours.held.any()
    assert (np.sort(ours.tetrahedra, axis=None) == np.sort(file.tetrahedra, axis=None)).all()

    class Mesh:
        points, cells_dict = file.nodes, {"triangle": file.triangles, "tetra": file.tetrahedra}

    assert (palpate.Tetrahedra(Mesh(), groups={"attached": [0, 1, 2]}, **tissue).tetrahedra == ours.tetrahedra).all()
    path = np.array([(0.0, -0.03, -0.004, 0.042), (0.1, -0.03, -0.004, 0.036)])
    assert np.abs(palpate.Session(ours, path=path, model="patch").run().force).max() > 0.0
    for mesh, groups, words in [
        ((file.nodes, file.tetrahedra + 1000), {}, "numbers of nodes below 884"),
        ((file.nodes, file.tetrahedra.astype(float)), {}, "whole numbers"),
        ((file.nodes, file.triangles), {}, "4 in a row"),
        ((file.nodes[:, :2], file.tetrahedra), {}, "shape"),
        (arrays, {"attached": [-1]}, "below 884"),
        (7, {}, "a tuple"),
        (scenes / "meshes/liver.msh", {}, "a file has its own"),
    ]:
        with pytest.raises(palpate.UsageError, match=words):
            palpate.Tetrahedra(mesh, groups=groups, **tissue)
    with pytest.raises(palpate.SceneError, match="body.fixed"):
        palpate.Tetrahedra(arrays, **tissue)
    with pytest.raises(palpate.SceneError) as caught:
        palpate.Tetrahedra(arrays, groups={"attached": [0]}, **{**tissue, "poisson_ratio": 0.5})
    assert caught.value.field == "body.tissue.poisson_ratio"


def test_numpy_counts_as_python(press):
    block = palpate.Block(np.array([8, 8, 8]), np.full(3, 0.06), stiffness_n_per_m=np.float64(30.0))
    rows = palpate.Session(block, path=np.array(press), model="hold", patch=np.array([4, 4, 2])).run()
    lists = palpate.Session(palpate.Block([8, 8, 8], [0.06] * 3), path=press, model="hold", patch=[4, 4, 2]).run()
    assert (rows.force == lists.force).all()


def test_the_demo_needs_no_file():
    assert len(palpate.Session(palpate.Scene.demo(), duration_s=0.05).run()) == 50
    assert len(palpate.Session(palpate.Scene.demo()).run(log=None)) == 5000


def test_other_threads_run_meanwhile(block, press):
    counted, done = [], threading.Event()

    def count():
        while not done.is_set():
            counted.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    began = time.perf_counter()
    palpate.Session(block, path=press, model="full").run()
    ended = time.perf_counter()
    done.set()
    thread.join()
    assert sum(began < moment < ended for moment in counted) > 10


def test_an_interrupt_ends_a_run(block):
    # A shell without job control starts what is in its background deaf to interrupts.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        with pytest.raises(KeyboardInterrupt):
            palpate.Session(block, path=(0.03, 0.03, 0.08), model="full", duration_s=600.0).run()
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_comparison_has_the_figures_of_the_command(command, scenes, tmp_path):
    scene = scenes / "drag_friction.toml"
    ours = palpate.compare(scene, models=["hold", "patch"], duration_s=0.4)
    theirs = json.loads(command("compare", scene, "--models", "hold,patch", "--models-only", "--duration", 0.4, "--json"))
    assert ours.keys() == theirs.keys() and ours["peak_n"] == theirs["peak_n"]
    assert [row["model"] for row in ours["models"]] == ["full", "hold", "hold", "patch", "patch"]
    for our, their in zip(ours["models"], theirs["models"]):
        assert our["error_percent"] == their["error_percent"] and our["latency_ms"] == their["latency_ms"]


def test_a_comparison_takes_a_session(block, press):
    session = palpate.Session(block, path=press, friction=0.5)
    found = palpate.compare(session, models=["patch"], latencies_ms=[0.0])
    full, patch = found["models"]
    assert full["error_percent"]["rms"] == 0.0 and 0.0 < patch["error_percent"]["rms"] < 50.0
    assert patch["cost"]["total_s_per_s"] > 0.0
    with pytest.raises(palpate.UsageError, match="the local models are"):
        palpate.compare(session, models=["magic"])


def test_a_reduction_has_the_figures_of_the_command(command, scenes):
    scene = scenes / "drag_friction.toml"
    ours = palpate.reduce(scene, every=4, order=6)
    theirs = json.loads(command("reduce", scene, "--every", 4, "--order", 6, "--json"))
    assert ours["locality"] == theirs["locality"] and isinstance(ours["locality"]["local"], bool)
