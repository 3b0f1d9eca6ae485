"""Light, dark and high contrast. Colours are those of Okabe and Ito, which stay apart for colour-blind eyes.

Source: M. Okabe, K. Ito, Color Universal Design (2008), in shades that are dark or light enough on each ground.
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
"""Theme of the applications at their start."""

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

CONTRAST = Theme(
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

THEMES = (DARK, LIGHT, CONTRAST)
"""All themes."""
NEXT = {"hapteq-dark": "hapteq-light", "hapteq-light": "hapteq-contrast", "hapteq-contrast": "hapteq-dark"}
"""The theme after each one, for a key that cycles through them."""


def register_themes(app: App[Any], chosen: str = DARK.name) -> None:
    """Make all themes known to the application, and choose one."""
    for theme in THEMES:
        app.register_theme(theme)
    app.theme = chosen
