"""Figures of recordings of which no time is known: axes count samples, where they would say seconds and hertz."""

from dataclasses import replace

from matplotlib.text import Text

from analysis.figures.picture import Picture
from analysis.wording import untimed_text


def in_samples(picture: Picture) -> Picture:
    """Before it is drawn."""
    for text in picture.figure.findobj(Text):
        if isinstance(text, Text):
            text.set_text(untimed_text(text.get_text()))
    caption, alternative = untimed_text(picture.caption), untimed_text(picture.alternative)
    return replace(picture, caption=caption, alternative=alternative)
