"""The code of docs/python.md and of the README runs as it stands there, but for the page, which nobody leaves by Ctrl-C here."""

import re

import palpate

from conftest import ROOT

BLOCK = re.compile(r"```python\n(.*?)```", re.S)


def test_the_page_s_code_runs(tmp_path, monkeypatch, block, press, capsys):
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    first, refused, device = BLOCK.findall((ROOT / "docs/python.md").read_text())
    assert "live.view()" in first
    names = {}
    exec(first.replace("live.view()", "live.view(open=False, seconds=1)"), names)
    assert names["run"].force.shape == (3000, 3) and palpate.read("run.mcap").damage is None
    capsys.readouterr()
    names = {"palpate": palpate, "body": block, "path": press}
    exec(refused, names)
    said = re.search(r"# (contact\..*)", refused)[1]
    assert capsys.readouterr().out.strip() == said
    exec(device, names)
    assert names["run"].force.shape == (1000, 3)


def test_the_readme_s_code_runs(capsys):
    (code,) = BLOCK.findall((ROOT / "python/README.md").read_text())
    exec(code, {})
    shape, peak_n = capsys.readouterr().out.splitlines()[0].rsplit(" ", 1)
    assert shape == "(1000, 3)" and 0.5 < float(peak_n) < 20.0
