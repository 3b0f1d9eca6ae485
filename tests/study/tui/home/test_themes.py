"""Colours that can be read, on every ground."""

import pytest
from textual.color import Color

from study.tui.themes import NEXT_THEME, THEMES


@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
@pytest.mark.parametrize("name", ["primary", "accent", "success", "warning", "error", "foreground"])
def test_every_colour_of_words_stands_out_from_every_ground(theme, name):
    wanted = 7.0 if name == "foreground" else 4.5
    for ground in (theme.background, theme.surface):
        assert ratio(getattr(theme, name), ground) >= wanted, (name, ground)


def test_the_key_that_changes_themes_goes_through_all_of_them():
    names = {theme.name for theme in THEMES}
    name, seen = "hapteq-dark", set()
    for _ in THEMES:
        seen.add(name)
        name = NEXT_THEME[name]
    assert seen == names
    assert name == "hapteq-dark"


def luminance(colour: str) -> float:
    """Relative luminance after WCAG 2.1."""
    parts = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in Color.parse(colour).normalized]
    return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]


def ratio(one: str, other: str) -> float:
    lighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)
