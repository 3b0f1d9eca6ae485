"""docs/safety.md: every hazard has its layers and tests that exist, and every limit there is the code's."""

import ast
import re
from functools import cache
from pathlib import Path

from protocols.definition.apparatus import SafetySettings
from study.devices.admission import HAND_STIMULUS_CAP_N, HAND_TOTAL_CAP_N
from study.devices.force_dimension.acceptance import VALID_FOR
from study.devices.force_dimension.connect import WATCHDOG_S
from study.devices.governor.plausibility import LATE_S

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "safety.md").read_text("utf-8")
TEST = re.compile(r"`(test_\w+)`")
ELSEWHERE = re.compile(r"pytest\.mark\.skipif\(not sys\.platform\.startswith\('linux'\), ")


@cache
def hazards() -> list[list[str]]:
    rows = [line for line in PAGE.splitlines() if re.match(r"\| H\d+ \|", line)]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


@cache
def existing() -> dict[str, list[str]]:
    """Names of tests, and the decorators and marks that hold for them, aliases resolved."""
    found: dict[str, list[str]] = {}
    for path in (ROOT / "tests").rglob("test_*.py"):
        body = ast.parse(path.read_text("utf-8")).body
        assigned = {
            node.targets[0].id: node.value
            for node in body
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
        }
        of_all = assigned.get("pytestmark", ast.List([]))
        marks = of_all.elts if isinstance(of_all, ast.List | ast.Tuple) else [of_all]
        for node in body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                # An alias such as `linux = pytest.mark.skipif(...)` counts as what it stands for.
                own = [
                    assigned.get(each.id, each) if isinstance(each, ast.Name) else each for each in node.decorator_list
                ]
                found[node.name] = [ast.unparse(each) for each in (*own, *marks)]
    return found


def test_hazards_are_numbered_and_whole():
    assert [row[0] for row in hazards()] == [f"H{number}" for number in range(1, len(hazards()) + 1)]
    assert len(hazards()) > 15
    for number, hazard, severity, layers, proofs in hazards():
        assert hazard and severity in ("high", "medium", "low"), number
        assert layers and TEST.findall(proofs), number


def test_a_high_hazard_has_more_than_a_single_layer_or_proof():
    weak = [row[0] for row in hazards() if row[2] == "high" and len(TEST.findall(row[4])) < 2]
    assert weak == []


def test_every_named_test_exists():
    named = set(TEST.findall(PAGE))
    assert len(named) > 40
    assert sorted(named - existing().keys()) == []


def test_every_named_test_runs_with_make_test():
    """A proof that is marked slow or skipped would stand there and not be run."""
    assert [name for name in sorted(set(TEST.findall(PAGE))) if is_put_off(existing().get(name, []))] == []


def is_put_off(decorators: list[str]) -> bool:
    """As a whole: a single case among others may be slow. What other systems than Linux skip is run here."""
    return any(
        re.match(r"pytest\.mark\.(slow|skip|skipif|xfail)", each) and not re.match(ELSEWHERE, each)
        for each in decorators
    )


def test_the_search_finds_tests_and_what_puts_them_off():
    known = existing()
    assert "test_the_search_finds_tests_and_what_puts_them_off" in known
    assert "test_no_such_test" not in known
    assert is_put_off(known["test_ten_million_ticks_of_false_readings_never_exceed_the_force_limits"])
    assert is_put_off(["pytest.mark.skipif(not RECORDINGS.exists(), reason='absent')"])
    assert not is_put_off(["pytest.mark.skipif(not sys.platform.startswith('linux'), reason='of Linux')"])


def test_the_limits_on_the_page_are_those_of_the_code():
    def said(name: str) -> str:
        (row,) = [line for line in PAGE.splitlines() if line.startswith("|") and f"`{name}`" in line.split("|")[3]]
        return row.split("|")[2]

    settings = SafetySettings(stimulus_cap_n=1.0, total_cap_n=2.0)
    for name, value, unit in (
        ("HAND_STIMULUS_CAP_N", HAND_STIMULUS_CAP_N, "N"),
        ("HAND_TOTAL_CAP_N", HAND_TOTAL_CAP_N, "N"),
        ("feedback_cap_n", settings.feedback_cap_n, "N"),
        ("watchdog_s", settings.watchdog_s, "s"),
        ("longest_trial_s", settings.longest_trial_s, "s"),
        ("LATE_S", LATE_S, "s"),
        ("WATCHDOG_S", 1000 * WATCHDOG_S, "ms"),
        ("VALID_FOR", VALID_FOR.days, "days"),
    ):
        assert f" {value:g} {unit}" in said(name), name


def test_the_page_is_linked_from_where_a_lab_begins():
    for page in ("hardware.md", "study_day.md", "site/mkdocs.yml"):
        assert "safety.md" in (ROOT / "docs" / page).read_text("utf-8"), page
