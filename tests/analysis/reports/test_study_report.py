import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from analysis.figures.study_pictures import draw_study_pictures
from analysis.psychophysics.ellipsoid import EllipsoidResult, compute_moment_ellipsoid, compute_phasor_ellipse
from analysis.psychophysics.study_analysis import analyse_study
from analysis.psychophysics.thresholds import RunEnd
from analysis.reports.study_report import render_study_report
from analysis.reports.supplementary_tables import make_detection_table, make_practice_table
from protocols.definition.declared_analysis import AnalysisSettings
from protocols.definition.staircase_rule import BayesianPlacement
from protocols.trial import Phase

VOID = {"meta", "link", "br", "img", "input", "hr"}


class Structure(HTMLParser):
    """Tags that open and close in order, ids, headings, references to the outside."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: Counter[str] = Counter()
        self.ids: list[str] = []
        self.outside: list[str] = []
        self.attributes: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.tags[tag] += 1
        self.attributes.append((tag, values))
        self.ids += [values["id"]] if "id" in values else []
        self.outside += [
            value
            for key, value in attrs
            if key in ("src", "href", "xlink:href") and not value.startswith(("#", "data:"))
        ]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def parse_page(html):
    structure = Structure()
    structure.feed(html)
    assert structure.open == []
    return structure


def make_ellipsoid():
    wave = np.exp(2j * np.pi * 25.0 * np.arange(2000) / 1000.0)
    samples = np.real(np.array([1.0, 0.5, 0.1j])[None, :] * wave[:, None])
    return EllipsoidResult(
        25.0, "direction_1", 1.0, compute_moment_ellipsoid(samples), compute_phasor_ellipse(samples, 1000.0, 25.0)
    )


@pytest.fixture
def render_report(protocol):
    def render(trials, ellipsoids=(), provenance=None, protocol=protocol) -> str:
        analysis = analyse_study(trials, protocol)
        pictures = draw_study_pictures(analysis, ellipsoids)
        return render_study_report(
            analysis, pictures, provenance or {"hapteq": "0.1.0"}, "2026-01-02T03:04:05Z", ellipsoids
        )

    return render


@pytest.fixture
def render_without_figures(protocol):
    """The page without its figures, which take longer to draw than all else, for tests of what it says."""

    def render(trials, protocol=protocol) -> str:
        return render_study_report(analyse_study(trials, protocol), (), {}, "2026-01-02T03:04:05Z")

    return render


@pytest.mark.slow
def test_a_full_study_is_one_page_that_needs_nothing_else(render_report, simulate_study):
    html = render_report(simulate_study(subjects=3), (make_ellipsoid(),))
    structure = parse_page(html)
    assert structure.outside == []
    assert [i for i, n in Counter(structure.ids).items() if n > 1] == []
    assert structure.tags["figure"] == structure.tags["svg"] == 4 + 3 + 5
    assert structure.tags["script"] == 0
    for words in (
        "Individual thresholds (N)", "comparison interval", "Tukey-Kramer", "Greenhouse-Geisser", "Friedman",
        "Acceleration ellipses", "All runs", "Methods", "2026-01-02T03:04:05Z", "There are only 3 participants",
    ):  # fmt: skip
        assert words in html


@pytest.mark.slow
def test_the_page_can_be_read_aloud(render_report, simulate_study):
    structure = parse_page(render_report(simulate_study(subjects=1)))
    assert ("html", {"lang": "en"}) in structure.attributes
    assert structure.tags["h1"] == 1
    assert structure.tags["caption"] == structure.tags["table"] > 0
    assert structure.tags["figcaption"] == structure.tags["figure"]
    assert all("scope" in values for tag, values in structure.attributes if tag == "th")
    assert all("aria-labelledby" in values for tag, values in structure.attributes if tag == "svg")


def test_the_page_follows_the_reader_into_the_dark_and_onto_paper(render_report):
    html = render_report([])
    assert "prefers-color-scheme: dark" in html
    assert "@media print" in html


@pytest.mark.slow
@pytest.mark.parametrize(
    ("felt", "banner"),
    [(None, "Simulated participants: no person took part."), (False, "Nothing was felt: people answered while")],
)
def test_what_is_no_measurement_of_people_says_so_in_a_banner(render_without_figures, simulate_study, felt, banner):
    html = render_without_figures(simulate_study(subjects=1, felt=felt))
    assert banner in html
    assert 'class="banner"' in html


def test_people_need_no_banner(render_without_figures, simulate_study):
    assert 'class="banner"' not in render_without_figures(simulate_study(subjects=1, felt=True))


def test_nothing_usable_is_reported(render_report):
    html = render_report([])
    parse_page(html)
    assert "There is no run to analyse." in html
    assert "There are no test trials, so there is no threshold of direction." in html
    assert "<table>" not in html


def test_one_participant_is_told_what_cannot_be_computed(render_without_figures, simulate_study):
    html = render_without_figures(simulate_study(subjects=1, felt=True))
    assert "1 participant, 5 runs, 5 of them complete" in html
    assert "Every group holds a single value" in html
    assert "needs two who have every condition; there are 1" in html
    assert "not computed" in html


@pytest.mark.slow
def test_a_clean_study_says_that_nothing_stands_out(render_without_figures, simulate_study):
    html = render_without_figures(simulate_study(subjects=5, true_n=(0.4,) * 5, seed=2, felt=True))
    assert "No irregularities" in html


SIDE_SECTIONS = (">Is the vibration felt at all?</h2>", ">Catch trials</h2>", ">Practice</h2>")


@pytest.mark.slow
def test_detection_catch_trials_and_practice_have_sections(render_report, all_trial_kinds, full_protocol):
    html = render_report(all_trial_kinds, protocol=full_protocol)
    parse_page(html)
    for words in (*SIDE_SECTIONS, "Felt from", "Direction above detection (dB)", "0 to 79 %", "<td>passed</td>"):
        assert words in html
    assert not re.search(r"\b(nan|inf|None)\b", html)


@pytest.mark.slow
def test_without_such_trials_there_is_no_such_section(render_without_figures, simulate_study, full_protocol):
    html = render_without_figures(simulate_study(subjects=3), protocol=full_protocol)
    assert not any(section in html for section in SIDE_SECTIONS)


@pytest.mark.slow
def test_detection_is_compared_with_direction_only_where_both_are_thresholds(all_trial_kinds, full_protocol):
    table = make_detection_table(analyse_study(all_trial_kinds, full_protocol))
    for _, _, felt, told, above in table.rows:
        assert (above == "–") == ("cut" in felt + told)
    assert {row[4][0] for row in table.rows} == {"+", "–"}


def test_detection_alone_is_a_report_too(render_report, all_trial_kinds, full_protocol):
    html = render_report([trial for trial in all_trial_kinds if trial.phase is Phase.DETECTION], protocol=full_protocol)
    parse_page(html)
    assert "No test run; 3 detection runs." in html
    assert SIDE_SECTIONS[0] in html


@pytest.mark.parametrize(("answers", "outcome"), [(1, "broken off"), (10, "not passed")])
def test_practice_says_how_it_ended(all_trial_kinds, full_protocol, answers, outcome):
    template = next(t for t in all_trial_kinds if t.phase is Phase.TRAINING and t.run == 1)
    trials = [replace(template, trial=number, correct=False) for number in range(answers)]
    (row,) = make_practice_table(analyse_study(trials, full_protocol)).rows
    assert row[-1] == outcome


@pytest.mark.slow
def test_what_the_cap_cut_is_marked_in_rows_means_intervals_and_effect_sizes(render_without_figures, simulate_study):
    html = render_without_figures(simulate_study(subjects=3, true_n=(0.4, 0.4, 0.4, 0.4, float("inf"))))
    rows = re.findall(r"<tr>.*?</tr>", html, re.DOTALL)
    (group,) = [row for row in rows if ">45 Hz<" in row and row.count("<td") == 6]
    assert re.search(r"2\.\d\d cut", group)
    assert html.count("interval, without coverage") == 2
    assert "Effect size, without coverage: η²" in html
    assert "Effect size, without coverage: partial η²" in html
    assert "lower bound" not in html.lower()
    assert "≥" not in html


@pytest.mark.slow
def test_without_a_cut_nothing_is_without_coverage(render_without_figures, simulate_study):
    assert (
        "without coverage"
        not in render_without_figures(simulate_study(subjects=5, true_n=(0.4,) * 5, seed=2, felt=True)).lower()
    )


@pytest.mark.slow
def test_runs_that_the_trial_limit_stopped_are_in_the_tables(render_without_figures, simulate_study, protocol):
    limited = replace(protocol, staircase=replace(protocol.staircase, trial_limit=90))
    trials = simulate_study(subjects=3, true_n=(0.4, 0.4, 0.4, 0.4, float("inf")), rule=limited.staircase)
    html = render_without_figures(trials, protocol=limited)
    assert html.count("<td>stopped</td>") == 2 * 2
    assert "missing because of the trial limit" in html


@pytest.mark.slow
def test_no_number_is_ever_nan(render_report, simulate_study):
    trials = [replace(trial, delivered_mps2=None) for trial in simulate_study(subjects=2) if trial.trial < 12]
    html = render_report(trials)
    assert not re.search(r"\b(nan|inf|None)\b", html)


@pytest.mark.slow
def test_text_from_outside_is_escaped(render_report, simulate_study):
    trials = [replace(trial, subject="<script>x</script>") for trial in simulate_study(subjects=1)]
    html = render_report(trials, provenance={"parent": "<b>&"})
    parse_page(html)
    assert "<script>" not in html
    assert "&lt;b&gt;&amp;" in html


@pytest.mark.slow
def test_the_same_study_gives_the_same_page(render_report, simulate_study):
    trials = [trial for trial in simulate_study(subjects=1) if trial.run < 3]
    assert render_report(trials) == render_report(trials)


@pytest.mark.slow
def test_where_psi_chose_the_levels_nothing_speaks_of_reversals(simulate_study, protocol):
    rule = replace(protocol.staircase, bayesian=BayesianPlacement(15))
    study = replace(protocol, staircase=rule, analysis=AnalysisSettings(primary="published", contrast_hz=(45.0, 5.0)))
    analysis = analyse_study(simulate_study(subjects=2, rule=rule), study)
    pictures = draw_study_pictures(analysis, ())
    drawn = " ".join(
        text.get_text()
        for picture in pictures
        for text in picture.figure.findobj(lambda artist: hasattr(artist, "get_text"))
    )
    said = render_study_report(analysis, pictures, {}, "2026-01-02T03:04:05Z")
    said = f"{re.sub('<[^>]*>', ' ', re.sub(r'src=.data[^>]*|<svg.*?</svg>', '', said, flags=re.DOTALL))} {drawn}"
    assert re.findall(r".{30}(?:[Rr]eversal|[Ss]taircase|peaks|valley).{30}", said) == []
    assert "Differences by Psi's posterior means" in said.replace("&#x27;", "'").replace("&#39;", "'")
    assert {row.ended for row in analysis.thresholds} == {RunEnd.PSI}
