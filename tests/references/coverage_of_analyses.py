"""Coverage, bias and type-1 error of every interval that a report prints, near the cap: `make coverage`.

Simulates studies of ten people whose median thresholds are 0.35, 0.6, 0.85, 3 and 4 N under the published staircase
and cap, and writes what it counted as a Python module that the reports read, and as the table of docs/statistics.md.
Nothing there is typed by hand; some 0.8 s of processor time per study.

    python tests/references/coverage_of_analyses.py 400     400 studies, as many of one participant alone
    python tests/references/coverage_of_analyses.py 0       the page anew from what was counted
"""

import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.comparisons import compare_group_means
from analysis.psychophysics.coverage.coverage_words import MEDIAN_TEXTS, MeasuredCoverage, format_coverage_table
from analysis.psychophysics.coverage.measured_coverage import MEASURED_COVERAGES
from analysis.psychophysics.group_contrasts import compute_contrasts
from analysis.psychophysics.hierarchy.likelihood_thresholds import LikelihoodThreshold
from analysis.psychophysics.hierarchy.primary import compute_primary_analysis
from analysis.psychophysics.hierarchy.single_persons import fit_single_persons
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.psychophysics.tobit import compute_tobit_contrasts
from analysis.psychophysics.two_analyses import SIMULATED_RULE

ROOT = Path(__file__).parents[2]
MODULE, PAGE = ROOT / "analysis/psychophysics/coverage/measured_coverage.py", ROOT / "docs/statistics.md"
BEGIN, END = "<!-- coverage: make coverage -->", "<!-- end of coverage -->"
HZ, MEDIANS_N, NULL_N, PEOPLE, CAP_N = (5.0, 15.0, 25.0, 35.0, 45.0), (0.35, 0.6, 0.85, 3.0, 4.0), 2.2, 10, 3.0
CROWD, NULL = Crowd(HZ, MEDIANS_N), Crowd(HZ, (NULL_N,) * 5)
SPREAD_DB = math.hypot(2.5, 1.7)

Found = tuple[str, float, float | None, bool]
"""Analysis, frequency, error in dB where there is a size, and whether the interval holds the truth."""


def judge(number: int) -> Iterator[Found]:
    study = simulate_study(CROWD, SIMULATED_RULE, PEOPLE, (71, number))
    true_db = 20.0 * np.log10(MEDIANS_N)
    primary = compute_primary_analysis(study.answers, CAP_N)
    families = {
        "model": primary.contrasts,
        "means": compute_contrasts(HZ, study.threshold_db, 0.95),
        "tobit": compute_tobit_contrasts(HZ, study.threshold_db, study.cap_reversals > 0, 0.95),
    }
    for name, family in families.items():
        for contrast in family:
            true = true_db[HZ.index(contrast.frequency_hz)] - true_db[0]
            covers = contrast.lower_db <= true <= contrast.upper_db
            yield name, contrast.frequency_hz, contrast.difference_db - true, covers
    yield from _published(study.threshold_n)
    yield from _runs("run", primary.runs, study.true_db)
    alone = simulate_study(CROWD, SIMULATED_RULE, 1, (72, number))
    yield from _runs("single", fit_single_persons(alone.answers, CAP_N).runs, alone.true_db)
    null = simulate_study(NULL, SIMULATED_RULE, PEOPLE, (73, number))
    yield "one-way", 0.0, None, compute_one_way_anova(_named(null.threshold_n)).p < 0.05


def _named(threshold_n):
    return {f"{f:g} Hz": list(column) for f, column in zip(HZ, threshold_n.T, strict=True)}


def _published(threshold_n) -> Iterator[Found]:
    """Tukey's intervals hold a difference of mean thresholds in newtons: of people who are normal in dB."""
    mean_n = np.array(MEDIANS_N) * math.exp((SPREAD_DB * math.log(10.0) / 20.0) ** 2 / 2.0)
    for pair in compare_group_means(compute_one_way_anova(_named(threshold_n))).pairs:
        if pair.first == "5 Hz":
            place = HZ.index(float(pair.second.split()[0]))
            yield "tukey", HZ[place], None, pair.lower <= mean_n[place] - mean_n[0] <= pair.upper


def _runs(name: str, runs: tuple[LikelihoodThreshold, ...], true_db) -> Iterator[Found]:
    subjects = list(dict.fromkeys(run.subject for run in runs))
    for run in runs:
        true = true_db[subjects.index(run.subject), HZ.index(run.frequency_hz)]
        low, high = (end if end is not None else far for end, far in ((run.lower_db, -99.0), (run.upper_db, 99.0)))
        yield name, run.frequency_hz, None if run.db is None else run.db - true, low <= true <= high


def measure(studies: int) -> list[MeasuredCoverage]:
    found: dict[tuple[str, float], list[tuple[float | None, bool]]] = {}
    for number in range(studies):
        for name, frequency_hz, error, covers in judge(number):
            if frequency_hz in MEDIAN_TEXTS or name == "one-way":
                found.setdefault((name, frequency_hz), []).append((error, bool(covers)))
    rows = []
    for (name, frequency_hz), each in found.items():
        errors = [error for error, _ in each if error is not None]
        bias = round(float(np.mean(errors)), 2) + 0.0 if errors else None
        rows.append(MeasuredCoverage(name, frequency_hz, bias, sum(covers for _, covers in each), len(each)))
    return sorted(rows, key=lambda row: (row.analysis, row.frequency_hz))


MODULE_DOCSTRING = '''"""Measured coverage near the force cap: how many intervals of a report contain the true value.

Reports print these counts beside each interval (`coverage_words`). Each row: analysis
(`coverage_words.INTERVAL_TITLES`), frequency (Hz; 0 where all frequencies are judged together), mean error (dB; None
where the analysis gives no size in dB), 95 % intervals that contain the true value (one-way: studies with a significant
difference although there is none), and all intervals.

Counted in simulated studies of ten people ("single": of one) with known thresholds under the published staircase and
cap (one-way: thresholds of equal median). Tobit gives no interval where all runs of a frequency are censored. Written
by `make coverage` (tests/references/coverage_of_analyses.py), never by hand; docs/statistics.md has the same table.
"""'''


def module_text(rows: list[MeasuredCoverage]) -> str:
    lines = "\n".join(
        f'    MeasuredCoverage("{row.analysis}", {row.frequency_hz}, {row.bias_db}, {row.covered}, {row.intervals}),'
        for row in rows
    )
    return (
        f"{MODULE_DOCSTRING}\n\n"
        "from analysis.psychophysics.coverage.coverage_words import MeasuredCoverage\n\n"
        f"MEASURED_COVERAGES = (\n{lines}\n)\n"
    )


def page_text(page: str, rows: list[MeasuredCoverage]) -> str:
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n\n" + "\n".join(format_coverage_table(rows)) + f"\n\n{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    asked = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    counted = measure(asked) if asked else list(MEASURED_COVERAGES)
    MODULE.write_text(module_text(counted), "utf-8")
    PAGE.write_text(page_text(PAGE.read_text("utf-8"), counted), "utf-8")
    sys.stdout.write("\n".join(format_coverage_table(counted)) + "\n")
