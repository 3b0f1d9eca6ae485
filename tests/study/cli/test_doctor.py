"""`hapteq doctor` as somebody before a study day and as a script uses it."""

import json
from importlib.metadata import packages_distributions

import pytest

from study.cli.main import main

needs_installation = pytest.mark.skipif(
    "hapteq" not in packages_distributions().get("hapteq_launcher", ()),
    reason="hapteq is not installed in this environment",
)


@pytest.fixture
def run(capsys):
    def call(*arguments: object) -> tuple[int, str]:
        capsys.readouterr()
        code = main(["doctor", *map(str, arguments)])
        return int(code), capsys.readouterr().out

    return call


@needs_installation
def test_where_all_is_fine_it_says_so(run, tmp_path):
    code, out = run("--timing", 0.3, "--data", tmp_path)
    assert code == 0, out
    lines = out.splitlines()
    assert [line for line in lines if not line.startswith(" ")][:3] == ["Installation", "Device", "Timing"]
    assert lines[-1].startswith("All ")
    assert "WRONG" not in out


@needs_installation
def test_a_program_gets_one_document(run, tmp_path):
    code, out = run("--timing", 0.3, "--data", tmp_path, "--json")
    document = json.loads(out)
    assert (code, document["fine"]) == (0, True)
    assert document["device"]["simulated"]
    assert {"name", "value", "fine", "advice"} == set(document["installation"][0])
    timing = document["timing"]
    assert (timing["seconds"], timing["health"]["missed_ticks"], timing["health"]["fault"]) == (0.3, 0, "none")
    assert timing["health"]["peak_command_n"] == 0
    assert 0 <= timing["lateness"]["median_ms"] <= timing["lateness"]["p99_ms"] <= timing["lateness"]["longest_ms"]


def test_timing_can_be_left_out(run, tmp_path):
    _, out = run("--timing", 0, "--data", tmp_path)
    assert "Timing" not in out
    _, out = run("--timing", 0, "--data", tmp_path, "--json")
    assert json.loads(out)["timing"] is None


def test_a_device_that_cannot_be_opened_is_a_finding_and_exit_code_3(run, tmp_path):
    code, out = run("--device", "omega3", "--data", tmp_path)
    assert code == 3
    assert "WRONG  Device             There is no device called 'omega3'." in out
    assert "Use --device simulated." in out
    assert out.splitlines()[-1].endswith("checks are not fine.")
    assert "Installation" in out


def test_an_installation_that_is_not_fine_is_exit_code_1(run, tmp_path):
    (tmp_path / "data").write_text("a file")
    code, out = run("--timing", 0, "--data", tmp_path / "data", "--json")
    assert code == 1
    document = json.loads(out)
    assert not document["fine"]
    assert "Data folder" in [finding["name"] for finding in document["installation"] if not finding["fine"]]


def test_a_negative_time_is_wrong_use(run):
    assert run("--timing", -1)[0] == 2
