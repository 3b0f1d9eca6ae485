"""The counts that reports print are those of the page, and say what the simulation says."""

import pytest

from analysis.psychophysics.coverage.coverage_words import (
    INTERVAL_TITLES,
    MEDIAN_TEXTS,
    describe_coverage,
    format_coverage_table,
)
from analysis.psychophysics.coverage.measured_coverage import MEASURED_COVERAGES
from tests.references.coverage_of_analyses import BEGIN, END, PAGE, judge, measure, module_text


def test_the_page_has_what_was_counted():
    table = PAGE.read_text("utf-8").split(BEGIN)[1].split(END)[0].strip()
    assert table.splitlines() == format_coverage_table(MEASURED_COVERAGES)


def test_every_interval_was_counted_at_every_median():
    assert {(row.analysis, row.frequency_hz) for row in MEASURED_COVERAGES} == {
        *((name, frequency_hz) for name in INTERVAL_TITLES if name != "one-way" for frequency_hz in MEDIAN_TEXTS),
        ("one-way", 0.0),
    }
    assert min(row.intervals for row in MEASURED_COVERAGES) >= 200
    assert all(describe_coverage(MEASURED_COVERAGES, name) for name in INTERVAL_TITLES)


def test_the_counts_are_of_these_analyses():
    """Below the cap the model holds what it says; above it reversal means do not, in any form."""
    share = {(row.analysis, row.frequency_hz): row.covered / row.intervals for row in MEASURED_COVERAGES}
    assert all(0.9 <= share["model", hz] <= 0.985 for hz in MEDIAN_TEXTS)
    assert all(0.9 <= share["run", hz] <= 0.985 for hz in MEDIAN_TEXTS)
    assert max(share["means", 45.0], share["tukey", 45.0]) < 0.2
    assert share["means", 45.0] < share["tobit", 45.0] < 0.9
    assert share["one-way", 0.0] < 0.03


@pytest.mark.slow
def test_two_studies_counted_anew_give_a_module_that_says_so():
    rows = measure(2)
    assert {row.intervals for row in rows if row.analysis == "model"} == {2}
    assert {row.intervals for row in rows if row.analysis == "run"} == {20}
    found = [covers for name, hz, _, covers in judge(0) if (name, hz) == ("run", 35.0)]
    again = [covers for name, hz, _, covers in judge(1) if (name, hz) == ("run", 35.0)]
    (row,) = [row for row in rows if (row.analysis, row.frequency_hz) == ("run", 35.0)]
    assert row.covered == sum(found) + sum(again)
    space: dict[str, object] = {}
    exec(module_text(rows), space)
    assert list(space["MEASURED_COVERAGES"]) == rows
