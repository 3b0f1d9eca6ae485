"""Colour themes of the terminal applications: dark, light and high contrast.

The hues are those of the palette of Okabe and Ito, which can be distinguished with colour vision deficiencies; some are
made darker or lighter to be legible on the background. Source: M. Okabe, K. Ito, Color Universal Design (2008).
"""

from typing import Any

from textual.app import App
from textual.theme import Theme

DARK = Theme(
    name="hapteq-dark",
    primary="#56B4E9",
    secondary="#0072B2",
    accent="#E69F00",
    success="#3FBF9A",
    warning="#F0E442",
    error="#FF7A3D",
    foreground="#E6E6E6",
    background="#14171A",
    surface="#1C2125",
    panel="#262C32",
    dark=True,
)
"""Light text on a dark background; the default theme."""

LIGHT = Theme(
    name="hapteq-light",
    primary="#0072B2",
    secondary="#56B4E9",
    accent="#8A5A00",
    success="#00694D",
    warning="#7A5C00",
    error="#B04A00",
    foreground="#1A1A1A",
    background="#F7F7F5",
    surface="#FFFFFF",
    panel="#E8E8E4",
    dark=False,
)
"""Dark text on a light background."""

HIGH_CONTRAST = Theme(
    name="hapteq-contrast",
    primary="#56B4E9",
    secondary="#56B4E9",
    accent="#F0E442",
    success="#5FE0B8",
    warning="#F0E442",
    error="#FF9A6B",
    foreground="#FFFFFF",
    background="#000000",
    surface="#000000",
    panel="#1A1A1A",
    dark=True,
)
"""High contrast: white text and bright colours on black."""

THEMES = (DARK, LIGHT, HIGH_CONTRAST)
NEXT_THEME = {"hapteq-dark": "hapteq-light", "hapteq-light": "hapteq-contrast", "hapteq-contrast": "hapteq-dark"}
"""Name of the theme that follows each theme, for a key that cycles through them."""


def register_themes(app: App[Any], theme_name: str = DARK.name) -> None:
    """Register the themes with the application and select one. theme_name: name of a theme, such as `DARK.name`."""
    for theme in THEMES:
        app.register_theme(theme)
    app.theme = theme_name
