"""Each kind of wrong input: a named error, an exit code, what to do; never a traceback.

In this process where that tells the same: an error without a name would leave `main` and fail the test. In a process of
its own where streams, environment or limits are at stake, and once for each kind of refusal."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from study.cli.main import main

pytestmark = pytest.mark.usefixtures("validated_here")

ROOT = Path(__file__).resolve().parents[3]
PATHS = os.pathsep.join((str(ROOT), str(ROOT / "study" / "launcher")))


def hapteq(*arguments: object, cwd: Path, stdin: str | None = "", env: dict | None = None):
    return subprocess.run(
        [sys.executable, "-m", "study", *map(str, arguments)],
        cwd=cwd,
        input=stdin,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": PATHS, **(env or {})},
        timeout=120,
    )


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """Runs one command in this process, in the test's folder; returns exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> tuple[int, str, str]:
        code = main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return int(code), said.out, said.err

    return call


def broken(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


CASES = {
    "a huge number": ("a.toml", "x = " + "9" * 5000, "protocol", "cannot be read"),
    "deep nesting": ("b.toml", "a=" + "[" * 2000, "protocol", "cannot be read"),
    "no TOML": ("c.toml", "name = = 3", "protocol", "line 1"),
    "nothing": ("d.toml", "", "protocol", "d.toml"),
    "a log that is none": ("P01_001/events.jsonl", "hello\n", "resume", "Line 1 of events.jsonl"),
    "an empty log": ("P01_001/events.jsonl", "", "resume", "never began"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_broken_file_is_named(tmp_path, refused, name):
    file, text, command, expected = CASES[name]
    path = broken(tmp_path, file, text)
    asked = ("protocol", "show", path) if command == "protocol" else ("resume", path.parent)
    code, out, err = refused(*asked)
    assert (code, out) == (1, "")
    assert expected in err


@pytest.mark.slow
def test_a_broken_file_and_a_wrong_place_end_a_program_of_their_own_alike(tmp_path):
    path = broken(tmp_path, "a_file", "name = = 3")
    for asked in (("protocol", "show", path), ("protocol", "lock", "sweep", "--data", path)):
        done = hapteq(*asked, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("study", "--observer", "ideal", "--data", "a_file"),
        pytest.param(("rehearse", "--subjects", "1", "--out", "a_file"), marks=pytest.mark.slow),
        ("analyze", "a_file"),
        ("analyze", "/dev/null"),
        ("protocol", "lock", "sweep", "--data", "a_file"),
        ("record", "ellipsoid", "--out", "a_file/e.h5"),
        ("record", "ellipsoid", "--out", "a_file"),
        ("record", "ellipsoid", "--out", "e.h5", "--place", "1", "0", "0"),
        ("record", "ellipsoid", "--out", "e.h5", "--place", "nan", "0", "0"),
        ("validate", "a_file", "nowhere", "/dev/null"),
        ("withdraw", "a_file", "--yes"),
        ("resume", "a_file"),
        ("real", "a_file", "--out", "found"),
        ("real", "nowhere", "--out", "a_file"),
        ("kit", "draw", "--out", "a_file"),
        ("kit", "seal", "a_file"),
        ("kit", "score", "a_file", "--diagnoses", "nowhere", "--out", "score.csv"),
    ],
    ids=" ".join,
)
def test_a_wrong_place_is_an_error_and_nothing_more(tmp_path, refused, arguments):
    (tmp_path / "a_file").write_text("mine\n")
    code, out, err = refused(*arguments)
    assert code in (1, 2, 3)
    assert "Traceback" not in err + out
    assert err or out
    assert (tmp_path / "a_file").read_text() == "mine\n"
    assert [p.name for p in tmp_path.iterdir()] == ["a_file"]


def test_a_full_standard_output_is_no_traceback(tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "study", "protocol", "list"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False, env={**os.environ, "PYTHONPATH": PATHS},
        )  # fmt: skip
    assert done.returncode != 0
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_terminal_that_knows_only_ascii_gets_question_marks(tmp_path, small_file):
    env = {"PYTHONIOENCODING": "ascii", "LC_ALL": "C", "PYTHONUTF8": "0"}
    person = ("study", "--plain", "--subject", "P01")
    done = hapteq(*person, "--protocol", small_file, "--data", tmp_path / "d", cwd=tmp_path, stdin="\nq\n", env=env)
    assert done.returncode == 130
    assert "up-left to down-right" in done.stdout
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_person_without_a_terminal_must_say_the_code(tmp_path, small_file):
    done = hapteq("study", "--plain", "--protocol", small_file, cwd=tmp_path)
    assert done.returncode == 2
    assert "--subject" in done.stderr
    assert not (tmp_path / "data").exists()


@pytest.mark.slow
def test_no_input_at_all_leaves_at_once(tmp_path, small_file):
    done = hapteq(
        "study", "--plain", "--subject", "P01", "--protocol", small_file, "--data", tmp_path / "d", cwd=tmp_path
    )
    assert done.returncode == 130
    assert "0 answers are on disk." in done.stderr


@pytest.fixture(scope="module")
def compiled(tmp_path_factory) -> None:
    """Compiled code is on disk before a limit on files holds: it is no part of the session."""
    folder = tmp_path_factory.mktemp("compiled")
    assert hapteq("record", "ellipsoid", "--out", folder / "warm.h5", cwd=folder).returncode == 0


@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize("size_kib", [8, 30])
def test_a_disk_that_fills_up_says_how_many_answers_are_safe_and_the_session_continues(tmp_path, small_file, size_kib):
    """A limit on the size of one file stands for a full disk: with 8 KiB recordings fail first, with 30 KiB the log."""
    script = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({size_kib * 1024},) * 2); "
        "from study.cli.main import main; sys.exit(main(sys.argv[1:]))"
    )
    arguments = ["study", "--observer", "scripted", "--protocol", str(small_file), "--data", str(tmp_path / "d")]
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": PATHS},
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    assert done.returncode == 1, done.stderr
    assert "1 answer is on disk." in done.stderr or "answers are on disk." in done.stderr
    again = hapteq("resume", "scripted1_001", "--data", tmp_path / "d", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
