"""Numbers below zero have the minus sign U+2212 on every page; a hyphen stands in dates, ranges and commands only."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from analysis.diagnosis.localisation.state_regions import describe_region
from analysis.diagnosis.real_answer.real_answer import OwnParameter
from analysis.diagnosis.result.wording import write_summary_lines
from analysis.evaluation.reproduction.document import FigureFindings, PlayedRow, Reproduction
from analysis.figures.study_pictures import draw_study_pictures
from analysis.psychophysics.ellipsoid import EllipsoidResult, compute_moment_ellipsoid, compute_phasor_ellipse
from analysis.psychophysics.study_analysis import analyse_study
from analysis.reports.diagnosis_report import render_diagnosis_report
from analysis.reports.real_report import describe_parameter
from analysis.reports.reproduction_report import render_reproduction_report
from analysis.reports.study_report import render_study_report
from analysis.wording import format_number, format_signed, typeset

HYPHEN_BEFORE_NUMBER = re.compile(r"(?<![\w-])-\.?\d\S*")
"""Not in "2026-01-02" nor "gpt-2": there something stands before it."""
MINUS_BEFORE_NUMBER = re.compile(r"−\.?\d")
NOT_READ = ("style", "script", "code", "pre")


class PageTexts(HTMLParser):
    """What a person reads on a page, without code."""

    def __init__(self) -> None:
        super().__init__()
        self.tag, self.found = "", []

    def handle_starttag(self, tag, attrs):
        self.tag = tag

    def handle_data(self, data):
        if self.tag not in NOT_READ and data.strip() and "hapteq " not in data:
            self.found.append(data)


def page_texts(html):
    reader = PageTexts()
    reader.feed(html)
    return reader.found


def assert_one_spelling(found):
    assert [text for text in found if HYPHEN_BEFORE_NUMBER.search(text)] == []
    assert any(MINUS_BEFORE_NUMBER.search(text) for text in found), "nothing below zero, so nothing was tested"


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (format_number(-1.5), "−1.50"), (format_number(-0.001), "0.00"), (format_number(2.0, 0), "2"),
        (format_signed(-1.26, 1), "−1.3"),
        (format_signed(1.26, 1), "+1.3"), (typeset("1e-07"), "1e−07"),
    ],
)  # fmt: skip
def test_a_number_is_written_with_the_minus_sign_and_a_zero_without(said, expected):
    assert said == expected


@pytest.mark.slow
def test_on_the_report_of_a_study(simulate_study, protocol):
    turned = replace(protocol, directions=replace(protocol.directions, symmetry_deg=-10.0))
    trials = simulate_study(subjects=3)
    wave = np.exp(2j * np.pi * 25.0 * np.arange(2000) / 1000.0)
    samples = np.real(np.array([1.0, -0.5, 0.1j])[None, :] * wave[:, None])
    ellipses = compute_moment_ellipsoid(samples), compute_phasor_ellipse(samples, 1000.0, 25.0)
    tilted = (EllipsoidResult(25.0, "direction_1", 1.0, *ellipses),)
    analysis = analyse_study(trials, turned)
    html = render_study_report(analysis, draw_study_pictures(analysis, tilted), {}, "2026-01-02T03:04:05Z", tilted)
    assert_one_spelling(page_texts(html))


def test_on_the_page_of_a_diagnosis(friction_findings, friction_pictures):
    html = render_diagnosis_report(friction_findings, friction_pictures, {"Recording": "rec.h5"}, "2026-01-01T00:00Z")
    assert_one_spelling(page_texts(html))
    assert [line for line in write_summary_lines(friction_findings) if HYPHEN_BEFORE_NUMBER.search(line)] == []


def test_on_the_page_of_the_published_figures():
    row = PlayedRow("nothing", "plant", (0.0, 0.0, 0.0), False, "sweep", 3.0, -6.2, -20.4, 5.0, 0.5, 1.0, 0)
    page = Reproduction("simulated", 1, 1, (5.0, 35.0), 26, (), (row,), (row,))
    figure = FigureFindings(5, "Played", "Figure 5", "coupling falls", (), ())
    html = render_reproduction_report(replace(page, figures=(figure,)), {}, {}, "2026-01-01T00:00Z")
    assert_one_spelling(page_texts(html))


def test_in_sentences():
    said = [
        describe_parameter(OwnParameter("mass", "kg", 0.9, 0.8, 1.0, 1.0)),
        describe_region("position", "x", "m", (1, 1, 4), -0.012, is_one_stratum=True),
    ]
    assert said[1] == "near x = −12 mm"
    assert describe_parameter(OwnParameter("offset", "N", 0.1, -0.1, 0.3, 0.0)).endswith(
        "known by other means is 0.00 N, and the interval holds it."
    )
    assert_one_spelling(said)
