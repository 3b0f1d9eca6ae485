"""Widget that shows the position of the handle relative to the circle within which a trial may start.

The circle is drawn with 40 % of the available radius, so that a handle outside it is shown to scale up to almost 2.5
times the radius.
"""

import math

from rich.segment import Segment
from rich.style import Style
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from study.session.views.participant_views import HandleView
from study.tui.drawing.braille import Canvas


class HandleTarget(Widget):
    """Draws the circle within which a trial may start, a cross in its centre, and the handle as a disc. Right and up
    are as in the picture of the stimulus directions. A handle too far away is drawn at the edge, in its direction."""

    DEFAULT_CSS = """
    HandleTarget { height: 1fr; min-height: 5; }
    """

    view: reactive[HandleView | None] = reactive[HandleView | None](None)
    """Position of the handle; None: nothing is drawn."""

    def render_line(self, y: int) -> Strip:
        width, height = self.size
        rows = max(1, min(height, width // 2))  # a character cell is twice as high as wide
        drawing_lines = _draw_target(self.view, 2 * rows, rows) if self.view is not None else []
        row = y - (height - rows) // 2
        text = drawing_lines[row] if 0 <= row < len(drawing_lines) else ""
        return Strip([Segment((" " * ((width - 2 * rows) // 2) + text).ljust(width), self.rich_style + BOLD)], width)


BOLD = Style(bold=True)


def _draw_target(view: HandleView, columns: int, rows: int) -> list[str]:
    """Draw the target as lines of braille characters. columns, rows: size in character cells. Lengths without a unit
    are in braille dots: the circle is two dots thick, the arms of the cross are 3 dots long, and the disc has 1/14 of
    the available radius, at least 2 dots."""
    canvas = Canvas(columns, rows)
    centre_x, centre_y = canvas.centre
    max_radius = min(centre_x, centre_y)
    # 1e-9 avoids a division by zero if a trial may start at no distance.
    dots_per_mm = 0.4 * max_radius / max(view.radius_mm, 1e-9)
    for radius in (dots_per_mm * view.radius_mm, dots_per_mm * view.radius_mm + 1):
        canvas.draw_circle((centre_x, centre_y), radius)
    canvas.draw_line((centre_x - 3, centre_y), (centre_x + 3, centre_y))
    canvas.draw_line((centre_x, centre_y - 3), (centre_x, centre_y + 3))
    right_mm, up_mm = view.offset_mm
    disc_radius = max(2.0, max_radius / 14)
    distance = dots_per_mm * math.hypot(right_mm, up_mm)
    inward_factor = min(1.0, (max_radius - disc_radius) / distance) if distance > 0 else 1.0
    canvas.draw_disc(
        (centre_x + inward_factor * dots_per_mm * right_mm, centre_y - inward_factor * dots_per_mm * up_mm), disc_radius
    )
    return canvas.render_lines()
