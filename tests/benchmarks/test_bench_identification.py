"""The benchmark against live peers runs without them, and its table of peers is complete."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
FOREIGN = {"LGPL-3.0-or-later"}
PERMISSIVE = {"BSD-2-Clause", "BSD-3-Clause", "MIT", "Apache-2.0"}


@pytest.fixture(scope="module")
def bench():
    """The script, and what it puts on the import path taken away again."""
    before = list(sys.path)
    spec = importlib.util.spec_from_file_location("bench_identification", FOLDER / "bench_identification.py")
    assert spec is not None and spec.loader is not None
    module = sys.modules["bench_identification"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    sys.path[:] = before


@pytest.mark.slow
def test_our_side_runs_and_is_within_its_bars(bench, monkeypatch, capsys):
    # How quick this machine is just now is for the benchmark to say.
    monkeypatch.setattr(bench, "CPU_S", 60.0)
    assert bench.main(["--peers", "none", "--seeds", "1", "--quick"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"hapteq: order 26, 1 kHz +1 +26 +\d+\.\d\d +1/1 +0\.\d+ +0\.\d+%", printed)
    assert "the raw estimate, taken for a model" in printed


def test_every_peer_is_pinned_with_its_licence_and_has_a_runner(bench):
    names = [peer.name for peer in bench.PEERS]
    assert len(set(names)) == len(names) >= 5
    for peer in bench.PEERS:
        assert peer.requirements[0].startswith(f"{peer.name}==")
        assert all(re.fullmatch(r"[\w-]+==[\d.]+", requirement) for requirement in peer.requirements)
        assert peer.licence in FOREIGN | PERMISSIVE
        assert (FOLDER / "peers" / peer.runner).is_file()
        assert peer.methods


def test_no_peer_is_a_dependency_nor_hides_behind_its_runner(bench):
    project = (FOLDER.parents[1] / "pyproject.toml").read_text()
    for peer in bench.PEERS:
        assert f'"{peer.name}' not in project
        # A runner's folder is the first place its imports are sought in.
        assert Path(peer.runner).stem != peer.name.replace("-", "_")


def test_environments_are_not_committed(bench):
    ignored = (FOLDER.parents[1] / ".gitignore").read_text().splitlines()
    assert ".venv-peers/" in ignored


@pytest.mark.slow
def test_a_peer_that_cannot_be_installed_is_a_row_that_says_why(bench, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    absent = bench.Peer("hapteq-absent", ("hapteq-absent==0.0.0",), "MIT")
    monkeypatch.setattr(sys.modules["environments"], "FOLDER", tmp_path)
    assert bench.peer_rows([absent], [], quick=True) == []
    printed = capsys.readouterr().out
    assert re.search(r"hapteq-absent +not installed: ERROR: No matching distribution found for hapteq-absent", printed)


@pytest.mark.slow
def test_a_method_that_fails_is_a_row_with_its_last_line(bench, tmp_path, capsys):
    row, _ = bench.rows_of(
        "hapteq", Path(sys.executable), bench.OURS, bench.Method("broken", {}), [tmp_path / "no.npz"]
    )
    bench.shown(row)
    assert not row.usable
    assert re.search(r"hapteq: broken +1 x failed: FileNotFoundError", capsys.readouterr().out)


def test_an_unknown_peer_is_refused_with_those_that_are_known(bench, capsys):
    with pytest.raises(SystemExit):
        bench.main(["--peers", "matlab"])
    assert "unknown peers: matlab; known are ctrlsys, nfoursid" in capsys.readouterr().err


def test_an_unstable_model_is_no_peer_that_could_be_used(bench, capsys):
    wild = bench.Score(1.0, 26, 1.2, (1e-4,), 1e-4, float("nan"))
    calm = bench.Score(1.0, 26, 0.9, (1e-3,), 1e-3, 1e-3)
    ours = bench.Row("hapteq", [calm])
    assert bench.Row("peer", [wild]).usable is False
    bench.compared(ours, [bench.Row("peer", [calm])])
    assert "1.00 (aim 0.4: not reached)" in capsys.readouterr().out
    better = bench.Score(1.0, 26, 0.9, (3e-4,), 1e-3, 3e-4)
    bench.compared(bench.Row("hapteq", [better]), [bench.Row("peer", [calm])])
    assert "0.30 (aim 0.4: reached)" in capsys.readouterr().out


def test_where_no_peer_ran_there_is_nothing_to_divide_by(bench, capsys):
    bench.compared(bench.Row("hapteq"), [bench.Row("peer")])
    assert "no peer gave a model: nothing to divide by" in capsys.readouterr().out
