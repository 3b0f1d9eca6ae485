"""Widget with the staircase of a run of a past session: title, plot, and a sentence that summarises the run."""

import itertools

from textual.content import Content
from textual.widget import Widget

from study.session.views.archive_views import Staircase
from study.tui.drawing.staircase_drawing import (
    LABEL_COLUMNS,
    MARK_STYLES,
    MUTED_STYLE,
    draw_staircase,
    summarise_staircase,
)

_TEXT_LINES = 2
"""Number of lines of title and summary, which the plot leaves free."""


class StaircasePlot(Widget):
    """Draws the title of a run, its staircase in the remaining height of the widget, and its summary."""

    DEFAULT_CSS = "StaircasePlot { height: 14; }"

    def __init__(self, staircase: Staircase) -> None:
        super().__init__()
        self._staircase = staircase

    def render(self) -> Content:
        width, height = self.content_size.width, self.content_size.height
        lines = draw_staircase(self._staircase, width, height - _TEXT_LINES)
        return Content("\n").join(
            [
                Content.styled(self._staircase.title, "bold"),
                *map(_apply_styles, lines),
                Content.styled(summarise_staircase(self._staircase), MUTED_STYLE),
            ]
        )


def _apply_styles(line: str) -> Content:
    """Apply to a line of the plot the styles of labels and marks. Neighbouring characters of equal style form one span,
    because fewer spans are drawn faster."""
    styled_parts: list[Content | str | tuple[str, str]] = [(line[:LABEL_COLUMNS], MUTED_STYLE)]
    for style, characters in itertools.groupby(line[LABEL_COLUMNS:], key=MARK_STYLES.get):
        text = "".join(characters)
        styled_parts.append((text, style) if style else text)
    return Content.assemble(*styled_parts)
