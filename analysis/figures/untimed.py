"""Figures of recordings without known time: labels in samples instead of seconds and hertz."""

from dataclasses import replace

from matplotlib.text import Text

from analysis.figures.picture import Picture
from analysis.wording import untimed_text


def count_in_samples(picture: Picture) -> Picture:
    """The picture with all its texts in samples; to be called before it is drawn."""
    for text in picture.figure.findobj(Text):
        if isinstance(text, Text):
            text.set_text(untimed_text(text.get_text()))
    caption, alternative = untimed_text(picture.caption), untimed_text(picture.alternative)
    return replace(picture, caption=caption, alternative=alternative)
