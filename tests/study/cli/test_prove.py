"""`hapteq prove` as a script would use it: one device, then folders that are not what they were."""

import json

import pytest

from study.cli.main import main
from study.evaluation.bank.proof_folder import ANSWER_FILE

SEED, CASES = 51_401, 1


@pytest.fixture
def run(capsys):
    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(["prove", *(str(a) for a in arguments)])
        said = capsys.readouterr()
        return int(code), said.out, said.err

    return call


def given(out, *more):
    return ("--out", out, "--cases", CASES, "--seed", SEED, "--brief", "--workers", 1, *more)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    out = tmp_path_factory.mktemp("cli") / "proof"
    assert main(["prove", *(str(a) for a in given(out))]) == 0
    return out


@pytest.fixture
def bank(done, tmp_path):
    """A copy of what is finished."""
    for path in done.rglob("*"):
        if path.is_file():
            there = tmp_path / "proof" / path.relative_to(done)
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_bytes(path.read_bytes())
    return tmp_path / "proof"


@pytest.mark.slow
def test_it_says_misses_first_and_leaves_table_and_page(done, run, tmp_path):
    code, out, _ = run(*given(done, "--table", tmp_path / "small.csv"))
    assert code == 0
    assert out.splitlines()[0].endswith(f"misses in {CASES} cases")
    assert (done / "report.html").stat().st_size > 1000
    assert (tmp_path / "small.csv").exists() and (tmp_path / "small-misses.csv").exists()


@pytest.mark.slow
def test_for_a_program_it_says_json(done, run):
    code, out, _ = run(*given(done, "--json"))
    assert (code, json.loads(out)["cases"]) == (0, CASES)


def torn(path):
    path.write_text(path.read_text(encoding="utf-8")[:30], encoding="utf-8")


def changed(path):
    path.write_text(path.read_text(encoding="utf-8").replace('"kind"', '"kind" '), encoding="utf-8")


SPOILED = {
    "a torn bank.json": (lambda bank: torn(bank / "bank.json"), "bank.json"),
    "a torn answer": (lambda bank: torn(next(bank.glob(f"open/*/{ANSWER_FILE}"))), ANSWER_FILE),
    "a changed label": (lambda bank: changed(next(bank.glob("sealed/*.json"))), "A seal is broken"),
    "seals that are none": (lambda bank: torn(bank / "labels.sha256"), "A seal is broken"),
    "a torn document": (lambda bank: torn(bank / "proof.json"), "proof.json"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("spoil", "words"), SPOILED.values(), ids=SPOILED)
def test_a_folder_that_is_not_what_it_was_is_named_and_nothing_is_scored(bank, run, spoil, words):
    spoil(bank)
    before = (bank / "report.html").read_bytes()
    code, out, err = run(*given(bank))
    assert (code, out) == (1, "")
    assert words in err and "Traceback" not in err
    assert (bank / "report.html").read_bytes() == before


@pytest.mark.parametrize(("option", "value"), [("--cases", 0), ("--workers", 0), ("--seed", -1), ("--cases", "many")])
def test_wrong_numbers_are_wrong_use(run, tmp_path, option, value):
    code, _, err = run("--out", tmp_path / "new", option, value)
    assert code == 2 and option in err
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
def test_a_folder_with_other_files_and_another_seed_are_refused(bank, run, tmp_path):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("mine", encoding="utf-8")
    code, _, err = run(*given(tmp_path / "other"))
    assert code == 1 and "A bank needs a folder of its own" in err
    code, _, err = run("--out", bank, "--cases", CASES, "--seed", SEED + 1, "--brief")
    assert code == 1 and "This folder holds another bank" in err


def test_controls_of_a_bank_of_laws_are_refused(run, tmp_path):
    code, _, err = run("--out", tmp_path / "new", "--laws", "--controls")
    assert code == 2 and "The bank of laws has no controls" in err
    assert not (tmp_path / "new").exists()
