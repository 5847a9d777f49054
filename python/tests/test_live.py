"""Sessions in real time, and their page. Counts and states are looked at, never times."""

import socket
import threading
import urllib.request

import numpy as np
import palpate
import pytest


def test_a_session_runs_on_threads_and_leaves_a_log(block, press, tmp_path):
    log = tmp_path / "run.mcap"
    with palpate.Session(block, path=press, model="patch").start(log=log) as live:
        assert "Live" in repr(live)
        live.wait()
        assert live.finished
    run = live.stop()
    assert run.faults == [] and not run.environment["is_virtual"]
    timing = run.timing["local"]
    assert len(timing) + timing["slips"].sum() >= 250, "every period is accounted for"
    read = palpate.read(log)
    assert read.damage is None and (read.force == run.force).all() and len(run.force) > 0
    assert np.isin(np.round(run.time * 1e3), np.arange(1, 252)).all()


def test_a_session_without_end_goes_on_until_it_is_stopped(block, press):
    live = palpate.Session(block, path=press, model="hold").start(endless=True)
    live.wait(0.2)
    assert not live.finished and live.elapsed > 0.1
    now = live.now()
    assert now["nodes"].shape == block.nodes.shape and now["position"].shape == (3,) and not now["nodes"].flags.writeable
    run = live.stop()
    assert live.finished and live.elapsed is None and len(run) > 50
    assert live.stop() is run
    with pytest.raises(palpate.UsageError):
        live.now()


def test_python_pushes_with_a_pointer(block):
    settings = {"device": {"kind": "pointer", "pointer": {"start_m": [0.03, 0.03, 0.07]}}}
    with palpate.Session(block, model="patch", settings=settings).start(endless=True) as live:
        live.point([0.03, 0.03, 0.05])
        live.wait(0.5)
        with pytest.raises(palpate.UsageError):
            live.point([0.03, 0.03, np.nan])
    run = live.stop()
    assert run.tool[-1, 2] < 0.065 and np.abs(run.force).max() > 0.0


def test_a_page_shows_it(block, press, capsys):
    with palpate.Session(block, path=press, model="patch").start(endless=True) as live:
        url = live.view(open=False, seconds=0)
        assert url in capsys.readouterr().out and "#" in url
        with urllib.request.urlopen(url.split("#")[0]) as answer:
            assert answer.status == 200 and b"<html" in answer.read().lower()
        assert live.view(open=False, seconds=0.05) == url
        live.wait(0.1)
    assert len(live.stop()) > 0


def test_a_page_that_cannot_be_leaves_the_session_as_it_is(block, press):
    with palpate.Session(block, path=press, model="patch").start(endless=True) as live, socket.create_server(("127.0.0.1", 0)) as taken:
        with pytest.raises(palpate.RefusedError, match="cannot listen"):
            live.view(open=False, seconds=0, port=taken.getsockname()[1])
        assert not live.finished and live.elapsed is not None
        assert "#" in live.view(open=False, seconds=0)
        live.wait(0.1)
    assert len(live.stop()) > 0


def test_a_thread_that_waits_is_in_nobodys_way(block, press):
    for shown in (False, True):
        live = palpate.Session(block, path=press, model="hold").start(endless=True)
        if shown:
            live.view(open=False, seconds=0)
        waiting = threading.Thread(target=live.wait, args=(20.0,))
        waiting.start()
        # A tenth of the wait each, if each waited for a look of the other thread's.
        for _ in range(1000):
            assert (live.elapsed is None) == shown
        assert waiting.is_alive()
        assert len(live.stop()) > 0
        waiting.join()
        assert live.finished


def test_what_now_took_no_page_can_have(block, press):
    with palpate.Session(block, path=press, model="hold").start(endless=True) as live:
        live.now()
        with pytest.raises(palpate.UsageError, match="call view"):
            live.view(open=False, seconds=0)


def test_the_plan_says_what_is_asked_of_the_cores(block, press):
    plan = palpate.Session(block, path=press, model="patch").plan()
    assert "local" in plan and "global" in plan
