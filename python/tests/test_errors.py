"""What cannot work is refused with its field and what would be right."""

import pickle

import palpate
import pytest


@pytest.mark.parametrize(
    "build, kind, field, words",
    [
        (lambda: palpate.Block([1, 2, 3], [1, 1, 1]), palpate.SceneError, "body.block.nodes", "must be at least 2"),
        (lambda: palpate.Block([2, 2], [1, 1, 1]), palpate.SceneError, "body.block.nodes", "must be an array of 3"),
        (lambda: palpate.Scene({"contact": {"frictoin": 1}}), palpate.SceneError, "contact.frictoin", "did you mean friction?"),
        (lambda: palpate.Scene({"glbal": {}}), palpate.SceneError, "glbal", "did you mean global?"),
        (lambda: palpate.Scene({"run": {"duration_s": None, "x": object()}}), palpate.UsageError, "run.x", "is a object"),
        (lambda: palpate.Scene(7), palpate.UsageError, "source", "must be the path of a scene file or a dictionary"),
        (lambda: palpate.Scene("no.toml"), palpate.FileError, None, "No such file"),
        (lambda: palpate.read("no.mcap"), palpate.FileError, None, "No such file"),
        (lambda: palpate.read(__file__), palpate.LogError, None, "no MCAP file"),
    ],
)
def test_refusals(build, kind, field, words):
    with pytest.raises(kind) as caught:
        build()
    error = caught.value
    assert error.field == field and words in error.remedy and "\n" not in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize(
    "keywords, field",
    [
        ({"friction": -1}, "contact.friction"),
        ({"model": "magic"}, "local.model"),
        ({"tool": palpate.Sphere(-0.004)}, "device.tool.radius_m"),
        ({"duration_s": 0}, "run.duration_s"),
        ({"crossfade_ms": 0.0}, "local.blend.ms"),
        ({"patch": [1, 1, 1], "model": "patch"}, "local.patch"),
        ({"attach_node": [99, 0, 0]}, "device.attach_node"),
        ({"probes": [[0, 0, 99]]}, "probe[0].node"),
        ({"settings": {"safety": {"off": ["clamp"]}}}, "safety.off"),
        ({"path": [(0.0, 1.0), (1.0, 2.0)]}, "path"),
        ({"path": [(1.0, 0, 0, 0), (0.5, 0, 0, 0)]}, None),
    ],
)
def test_a_session_is_refused_by_the_field_of_a_scene(block, press, keywords, field):
    with pytest.raises(palpate.Error) as caught:
        palpate.Session(block, **{"path": press, **keywords})
    assert isinstance(caught.value, ValueError)
    assert field is None or caught.value.field == field


@pytest.mark.parametrize("keywords", [{"tool": palpate.Sphere(0.004)}, {"attach_node": [3, 3, 7]}])
def test_what_is_of_one_tool_is_refused_where_several_are_listed(block, press, keywords):
    hand = {"kind": "pointer", "pointer": {"start_m": [0.03, 0.03, 0.07]}}
    settings = {"device": [{"name": "left", **hand}, {"name": "right", **hand}]}
    palpate.Session(block, settings=settings)
    with pytest.raises(palpate.UsageError, match="a list of them") as caught:
        palpate.Session(block, settings=settings, **keywords)
    assert caught.value.field == next(iter(keywords))


def test_a_file_is_named_with_its_line(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text("[body]\nkind = 'mass_spring'\n[body.block]\nnodes = [8, 8]\n")
    with pytest.raises(palpate.SceneError) as caught:
        palpate.Scene(scene)
    assert caught.value.file == str(scene) and caught.value.line == 4 and caught.value.field == "body.block.nodes"


def test_nothing_moves_the_tool(block):
    with pytest.raises(palpate.SceneError, match="nothing moves the tool"):
        palpate.Session(block).run()
