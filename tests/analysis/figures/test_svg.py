from xml.etree import ElementTree

from analysis.figures.picture import render_inline_svg
from analysis.figures.style import create_figure


def make_figure():
    figure = create_figure(3, 2)
    axes = figure.add_subplot()
    axes.plot([1, 2], [1, 2], "o-")
    axes.set_xlabel("Frequency (Hz)")
    return figure


def test_the_element_stands_alone_and_has_a_title():
    svg = render_inline_svg(make_figure(), "one", "A < B & C")
    root = ElementTree.fromstring(svg)
    assert root.tag.endswith("svg")
    assert root.attrib["role"] == "img"
    assert root[0].text == "A < B & C"
    assert root[0].attrib["id"] == root.attrib["aria-labelledby"] == "one-title"


def test_text_stays_text():
    assert "Frequency (Hz)</text>" in render_inline_svg(make_figure(), "one", "x")


def test_the_same_figure_gives_the_same_text():
    assert render_inline_svg(make_figure(), "one", "x") == render_inline_svg(make_figure(), "one", "x")


def test_two_figures_of_a_page_share_no_id_and_every_reference_is_met():
    ids = []
    for name in ("one", "two"):
        root = ElementTree.fromstring(render_inline_svg(make_figure(), name, "x"))
        own = {element.attrib["id"] for element in root.iter() if "id" in element.attrib}
        used = {
            value.removeprefix("url(").rstrip(")").removeprefix("#")
            for element in root.iter()
            for key, value in element.attrib.items()
            if (key.endswith("href") and value.startswith("#")) or value.startswith("url(#")
        }
        assert used
        assert used <= own
        ids.append(own)
    assert not ids[0] & ids[1]
