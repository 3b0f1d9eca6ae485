from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.text import Annotation

from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.diagnosis.result.findings import Signature
from analysis.diagnosis.result.residual_spectrum import compute_held_out_spectra
from analysis.figures.diagnosis.held_out import draw_held_out, find_excerpt
from analysis.figures.diagnosis.mismatch_map import draw_mismatch_map, make_mismatch_map_picture
from analysis.figures.diagnosis.residual_spectra import draw_residual_spectra
from analysis.figures.diagnosis.rivals import draw_rivals, list_explanations, make_rivals_pictures
from analysis.figures.diagnosis.signature import draw_signature, make_signature_pictures
from analysis.figures.picture import render_picture_svg
from analysis.figures.style import create_figure, format_power_of_ten, set_ratio_ticks


def make_cell(output="ax", input_="fx", low_hz=8.0, amplitude=1.0, in_noise=5.0, p=1e-6, quantity="acceleration"):
    return MismatchCell(
        output, quantity, input_, (low_hz, 2 * low_hz), amplitude, 0.1, 1.0, in_noise, 0.02, p, p, 1.0
    )  # fmt: skip


def axes_texts(figure):
    return [text.get_text() for axes in figure.axes for text in axes.texts]


@pytest.mark.slow
def test_a_diagnosis_has_every_picture_and_each_is_reported_in_words(friction_pictures):
    names = [picture.name for picture in friction_pictures]
    assert names == ["mismatch-map-1", "state-map", "state-loops", "signature-1", "rivals-1", "held-out", "remainder"]
    assert all(picture.alternative and picture.caption for picture in friction_pictures)
    for picture in friction_pictures:
        root = ElementTree.fromstring(render_picture_svg(picture))
        labels = root.attrib["aria-labelledby"].split()
        told = {each.attrib["id"]: each.text for each in root.iter() if each.attrib.get("id") in labels}
        assert told[labels[0]] == picture.title
        assert told[labels[1]] == picture.alternative


def cell_numbers(axes):
    return [text.get_text() for text in axes.texts if not isinstance(text, Annotation)]


def annotation_texts(axes):
    return [text.get_text() for text in axes.texts if isinstance(text, Annotation)]


def test_the_map_has_a_row_of_panels_per_level_and_a_column_per_stage():
    grid = [(level, low, output) for level in (0.5, 1.5, 3.0) for low in (4.0, 8.0) for output in ("ax", "ay", "az")]
    cells = tuple(make_cell(output, amplitude=level, low_hz=low) for level, low, output in grid)
    axes = draw_mismatch_map({"before": cells, "retuned": cells, "after": cells}, "fx", "N").axes[0]
    panels = next(collection for collection in axes.collections if isinstance(collection, PolyCollection))
    assert len(panels.get_paths()) == 9
    assert annotation_texts(axes) == [
        "as given",
        "re-tuned",
        "with the effects found",
        "at 0.5 N",
        "at 1.5 N",
        "at 3 N",
    ]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["4", "8"] * 3


def test_levels_stand_beside_the_channels_where_panels_are_too_low_for_them():
    cells = tuple(make_cell(amplitude=level) for level in (0.0137, 0.0184))
    axes = draw_mismatch_map({"before": cells}, "fx", "N").axes[0]
    assert annotation_texts(axes) == ["as given"]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["ax at 0.0137", "ax at 0.0184"]


def test_a_cell_of_the_map_has_its_colour_where_its_channel_octave_level_and_stage_are():
    loud = make_cell("ay", low_hz=8.0, amplitude=2.0, in_noise=40.0)
    quiet = tuple(make_cell(name, low_hz=low, amplitude=level, in_noise=1.0)
                  for name in ("ax", "ay") for low in (4.0, 8.0) for level in (1.0, 2.0))  # fmt: skip
    axes = draw_mismatch_map({"before": quiet, "retuned": (*quiet, loud)}, "fx", "N").axes[0]
    shown = axes.images[0].get_array().filled(np.nan)
    left, right, bottom, top = axes.images[0].get_extent()
    rows, columns = np.nonzero(shown == 40.0)
    x = left + (right - left) * (columns.mean() + 0.5) / shown.shape[1]
    y = top + (bottom - top) * (rows.mean() + 0.5) / shown.shape[0]
    (number,) = [text for text in axes.texts if text.get_text() == "40"]
    assert (x, y) == pytest.approx(number.get_position())
    assert dict(zip(axes.get_xticks(), axes.get_xticklabels(), strict=True))[x].get_text() == "8"
    assert dict(zip(axes.get_yticks(), axes.get_yticklabels(), strict=True))[y].get_text() == "ay"
    (stage,) = [text for text in axes.texts if text.get_text() == "re-tuned"]
    assert x - stage.xy[0] == pytest.approx(1.5)


@pytest.mark.parametrize("stages", [("before",), ("before", "retuned", "after")])
@pytest.mark.parametrize("name", ["ax", "handle_acceleration_x"])
def test_all_of_the_map_is_inside_the_picture(stages, name):
    cells = tuple(make_cell(name, amplitude=level, low_hz=low) for level in (0.5, 3.0) for low in (4.0, 8.0))
    figure = draw_mismatch_map(dict.fromkeys(stages, cells), "fx", "N")
    FigureCanvasAgg(figure).draw()
    whole = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert whole.x0 >= 0 and whole.y0 >= 0 and whole.x1 <= width and whole.y1 <= height


def test_what_is_significant_is_framed_and_what_is_more_than_noise_has_its_number():
    cells = (
        make_cell(in_noise=5.0),
        make_cell(output="ay", in_noise=1.2, p=0.5),
        make_cell(output="y", in_noise=1.1, p=0.9),
        make_cell(output="az", in_noise=2400.0),
    )
    axes = draw_mismatch_map({"before": cells}, "fx", "N").axes[0]
    frames = next(collection for collection in axes.collections if isinstance(collection, LineCollection))
    assert len(frames.get_segments()) == 2
    assert cell_numbers(axes) == ["5", "1.2", "2.4k"]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["ax", "ay", "y", "az"]


def test_many_levels_are_drawn_in_groups_of_which_the_worst_is_shown():
    cells = tuple(make_cell(amplitude=float(level), in_noise=float(level)) for level in range(1, 9))
    picture = make_mismatch_map_picture({"before": cells}, 0, "N")
    assert "8 levels are drawn in 4 groups" in picture.caption
    assert cell_numbers(picture.figure.axes[0]) == ["2", "4", "6", "8"]


def test_each_input_has_a_map_and_all_but_the_worst_are_folded():
    maps = {"before": (make_cell(), make_cell(input_="fy", in_noise=50.0))}
    pictures = [make_mismatch_map_picture(maps, number, "N") for number in range(2)]
    assert [(picture.title[-2:], picture.folded) for picture in pictures] == [("fy", False), ("fx", True)]
    assert "1 of 1 cells differ significantly; the worst is ax at 8 to 16 Hz" in pictures[0].alternative


def test_channels_of_one_name_are_distinguished_by_their_quantity():
    axes = draw_mismatch_map({"before": (make_cell("x"), make_cell("x", quantity="position"))}, "fx", "N").axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["x (acceleration)", "x (position)"]


def test_a_signature_shows_dots_with_errors_and_the_law_in_units_that_read_well(friction_findings):
    axes = draw_signature(friction_findings.signatures[0]).axes[0]
    assert axes.get_xlabel() == "Velocity of x (mm/s)"
    assert axes.get_ylabel() == "Missing force (N)"
    (law,) = [line for line in axes.lines if line.get_label() == "fitted law"]
    assert law.get_ydata().max() == pytest.approx(0.2, abs=0.01)
    assert law.get_xdata().max() > 10


def test_a_signature_without_samples_says_so(friction_findings):
    none = np.zeros(0)
    empty = replace(friction_findings.signatures[0], measured_abscissa=none, measured=none, standard_error=none)
    assert [text.get_text() for text in draw_signature(empty).texts] == ["Too few samples show this effect to draw it."]


def test_the_excerpt_lies_in_held_out_data_where_the_named_effect_changes_the_prediction(friction_findings):
    found = find_excerpt(friction_findings.time_series, friction_findings.noise_rms)
    series = friction_findings.time_series[0]
    (tested,) = series.tested
    assert tested[0] <= found.start < found.stop <= tested[1]
    part = slice(found.start, found.stop)
    change = (series.retuned - series.after)[:, found.channel] / friction_findings.noise_rms[
        series.channels[found.channel]
    ]
    assert np.std(change[part]) > np.std(change[slice(*tested)])


def test_without_a_change_there_is_no_excerpt(friction_findings):
    series = friction_findings.time_series[0]
    same = replace(series, before=series.after, retuned=series.after)
    assert find_excerpt((same,), friction_findings.noise_rms) is None
    assert find_excerpt((), {}) is None


def test_errors_of_every_channel_stand_beside_the_noise_line(friction_findings):
    axes = draw_held_out(None, {}, friction_findings.channel_errors).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["ax", "x"]
    marks = {line.get_marker(): line.get_xdata() for line in axes.lines if line.get_marker() != "None"}
    assert list(marks["o"]) == list(friction_findings.channel_errors["after"].values())
    assert axes_texts(axes.figure) == ["noise"]


def test_the_remainder_lies_on_the_noise_where_all_is_explained(friction_findings):
    for each in compute_held_out_spectra(friction_findings.time_series, friction_findings.floor):
        over = each.after / each.noise
        assert np.median(over) == pytest.approx(1.0, abs=0.15)
        assert np.max(each.retuned / each.noise) > 10


def test_a_spectrum_of_white_noise_has_the_density_of_its_rms(friction_findings):
    series = friction_findings.time_series[0]
    noise = np.random.default_rng(1).standard_normal(series.measured.shape)
    white = replace(series, measured=series.after + noise)
    spectrum = compute_held_out_spectra((white,), None)[0]
    assert spectrum.after[-10:].mean() == pytest.approx(np.sqrt(2 / series.sample_rate_hz), rel=0.05)
    assert np.isnan(spectrum.noise).all()


def test_without_held_out_data_nothing_is_drawn(friction_findings):
    series = replace(friction_findings.time_series[0], tested=())
    assert compute_held_out_spectra((series,), friction_findings.floor) == ()
    sentence = "There are no held-out data to draw."
    assert [text.get_text() for text in draw_residual_spectra(()).texts] == [sentence]
    assert [text.get_text() for text in draw_held_out(None, {}, {}).texts] == [sentence]


def test_rivals_stand_below_the_best_with_their_errors(friction_findings):
    tried = list_explanations(friction_findings.explanation.rounds[0], ("x",))
    assert [each.words for each in tried] == ["dry friction", "a dead band of the force"]
    assert tried[0].training_error < 1.1 < tried[1].training_error
    axes = draw_rivals(tried, replace(tried[1], words="re-tuned")).axes[0]
    assert axes_texts(axes.figure) == ["noise", "re-tuned"]
    assert axes.get_yticklabels()[0].get_fontweight() == "bold"


def test_the_one_that_was_chosen_stands_on_top_even_where_another_has_less_error(friction_findings):
    best, worse = friction_findings.explanation.rounds[0]
    tried = list_explanations((worse, best), ("x",))
    assert [each.words for each in tried] == ["a dead band of the force", "dry friction"]


def test_a_round_that_brought_nothing_is_folded_and_reports_it(friction_findings):
    explanation = replace(friction_findings.explanation, steps=())
    (picture,) = make_rivals_pictures(explanation, ("x",))
    assert picture.folded
    assert picture.title == "What was tried for the first effect; none was accepted"
    assert picture.figure.axes[0].get_yticklabels()[0].get_fontweight() != "bold"


@pytest.mark.parametrize("high", [1.4, 3.0, 50.0, 800.0, 2e4, 3e6])
def test_there_is_room_for_every_tick_of_a_ratio(high):
    axes = create_figure(4.0, 3.0).add_subplot()
    axes.set_xscale("log")
    set_ratio_ticks(axes.xaxis, 0.7, high)
    assert 2 <= len(axes.get_xticks()) <= 14


@pytest.mark.parametrize(("value", "words"), [(1e-3, "10⁻³"), (1.0, "10⁰"), (1e12, "10¹²"), (0.0, "")])
def test_powers_of_ten_are_written_out(value, words):
    assert format_power_of_ten(value) == words


def test_a_map_without_a_known_noise_says_so():
    figure = draw_mismatch_map({}, "fx", "N")
    assert [text.get_text() for text in figure.texts] == ["The noise is not known, so there is no map in its units."]


@pytest.mark.parametrize(
    ("effect", "line"),
    [("coulomb_friction", "simulated and averaged"), ("discovered_law", "the formula"), ("oil_drag", "the formula")],
)
def test_the_caption_of_a_signature_says_whether_its_line_is_a_formula(effect, line):
    """A law of an effect file has a name of its own."""
    dots = np.linspace(-1.0, 1.0, 5)
    signature = Signature(effect, "x", "velocity of x (m/s)", "missing force (N)", dots, dots, 0 * dots, dots, dots)
    (picture,) = make_signature_pictures((signature,))
    assert line in picture.caption.partition("Line: ")[2].partition(".")[0]
