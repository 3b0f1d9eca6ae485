"""Drawings and descriptions of the two directions between which a participant decides.

A direction is a line segment in a plane at an angle in degrees, counted from the plane's first axis towards its second;
it has no sign. The two segments differ in number, position and line style, not in colour, so that they can be
distinguished on every terminal. They are drawn with Braille dots (2 x 4 per character). Proportions of arrowheads,
dashes and barbs are chosen by hand.
"""

import math
from functools import lru_cache

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import DirectionPicture
from study.tui.drawing.braille import Canvas

END_WORD_KEYS = {
    "yz": (("end_right", "end_left"), ("end_up", "end_down")),
    "xy": (("end_toward", "end_away"), ("end_right", "end_left")),
    "zx": (("end_up", "end_down"), ("end_toward", "end_away")),
}
"""Keys of the words for the positive and the negative end of a plane's first and second axis."""

SCREEN_AXES = {"yz": ((1, 0), (0, 1)), "xy": ((0, -1), (1, 0)), "zx": ((0, 1), (1, 0))}
"""Where a plane's first and second axis point on the screen: (right, up). With x towards the operator, y to the right
and z up, 'yz' is seen from the operator's side, 'xy' from above, and 'zx' from the left."""


def describe_direction(picture: DirectionPicture, number: int, words: Words = ENGLISH_WORDS) -> str:
    """A direction in words with its number (1 or 2), such as "1: up-left to down-right"."""
    return words.fill("direction", {"number": number, "ends": describe_direction_ends(picture, number, words)})


def describe_direction_ends(picture: DirectionPicture, number: int, words: Words = ENGLISH_WORDS) -> str:
    """Both ends of a direction (1 or 2) in words, such as "up-left to down-right"."""
    angle = picture.angle_deg[number - 1]
    start, end = _describe_end(picture.plane, angle, words), _describe_end(picture.plane, angle + 180, words)
    return words.fill("direction_ends", {"start": start, "end": end})


def draw_directions(picture: DirectionPicture, columns: int = 18, rows: int = 9) -> list[str]:
    """Lines of text with both directions side by side: 1 solid, 2 dashed, each with its number below. columns, rows:
    size of each drawing in characters."""
    first_lines = _draw_direction(picture.plane, picture.angle_deg[0], columns, rows, dashed=False)
    second_lines = _draw_direction(picture.plane, picture.angle_deg[1], columns, rows, dashed=True)
    numbers = f"{'1'.center(columns)}    {'2'.center(columns)}"
    return [f"{a}    {b}".rstrip() for a, b in zip(first_lines, second_lines, strict=True)] + [numbers.rstrip()]


@lru_cache(maxsize=64)
def draw_large_direction(picture: DirectionPicture, number: int, columns: int, rows: int) -> tuple[str, ...]:
    """One direction (1 or 2) as large as fits into columns x rows characters: a thick segment with an arrowhead at both
    ends; 1 solid, 2 dashed."""
    canvas = Canvas(columns, rows)
    unit_right, unit_up = _project_to_screen(picture.plane, picture.angle_deg[number - 1])
    x, y = canvas.centre
    half_length = _compute_half_length(picture, x, y)
    thickness = max(2.5, half_length / 8)
    head_length = 2.6 * thickness
    shaft = half_length - head_length

    def canvas_point(distance: float, offset: float = 0.0) -> tuple[float, float]:
        # Point of the canvas from coordinates along and across the segment; y of the canvas points downwards.
        return x + distance * unit_right + offset * unit_up, y - distance * unit_up + offset * unit_right

    for sign in (-1, 1):
        base = sign * shaft
        canvas.fill_polygon(
            (
                canvas_point(sign * half_length),
                canvas_point(base, 1.5 * thickness),
                canvas_point(base, -1.5 * thickness),
            )
        )
    for dash_start, dash_end in (
        ((-shaft, shaft),) if number == 1 else _compute_dash_bounds(shaft, 2.2 * thickness, 1.1 * thickness)
    ):
        canvas.draw_bar(canvas_point(dash_start), canvas_point(dash_end), thickness)
    return tuple(canvas.render_lines())


def _compute_half_length(picture: DirectionPicture, x: float, y: float) -> float:
    """Half length of a segment in dots: the largest at which both directions fit into the canvas, at most 1.25 times
    its smaller half side. The same for both, so that neither looks stronger. x, y: half width and half height of the
    canvas (dots)."""
    unit_vectors = [_project_to_screen(picture.plane, angle) for angle in picture.angle_deg]
    largest_half_length = min(
        min(x / max(abs(unit_right), 1e-9), y / max(abs(unit_up), 1e-9)) for unit_right, unit_up in unit_vectors
    )
    return min(largest_half_length, 1.25 * min(x, y))


def _compute_dash_bounds(half_length: float, dash: float, gap: float) -> list[tuple[float, float]]:
    """Start and end of each dash along the segment from -half_length to half_length, evenly spaced, with a gap at both
    ends. dash, gap: desired lengths, stretched so that a whole number of dashes fits."""
    count = max(1, round((2 * half_length - gap) / (dash + gap)))
    stretch = 2 * half_length / (count * dash + (count + 1) * gap)
    starts = [-half_length + stretch * (gap + i * (dash + gap)) for i in range(count)]
    return [(start, start + stretch * dash) for start in starts]


def _draw_direction(plane: str, angle_deg: float, columns: int, rows: int, dashed: bool) -> list[str]:
    """Lines of text with a thin segment and an open arrowhead (two barbs of 5 dots at 30 degrees) at both ends."""
    canvas = Canvas(columns, rows)
    unit_right, unit_up = _project_to_screen(plane, angle_deg)
    cx, cy = (canvas.width - 1) / 2, (canvas.height - 1) / 2
    half_length = 0.95 * min(cx, cy)
    start, end = (
        (cx - half_length * unit_right, cy + half_length * unit_up),
        (cx + half_length * unit_right, cy - half_length * unit_up),
    )
    canvas.draw_line(start, end, dashed)
    for tip, turn_deg in ((start, 180.0), (end, 0.0)):
        for spread_deg in (150.0, -150.0):
            heading_deg = math.degrees(math.atan2(unit_up, unit_right)) + turn_deg + spread_deg
            heading_rad = math.radians(heading_deg)
            barb = (tip[0] + 5 * math.cos(heading_rad), tip[1] - 5 * math.sin(heading_rad))
            canvas.draw_line(tip, barb)
    return canvas.render_lines()


def _project_to_screen(plane: str, angle_deg: float) -> tuple[float, float]:
    """Unit vector of a direction on the screen, (right, up)."""
    first, second = SCREEN_AXES[plane]
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return c * first[0] + s * second[0], c * first[1] + s * second[1]


def _describe_end(plane: str, angle_deg: float, words: Words) -> str:
    """One end of a direction in words; a component of at most 0.2 (about 11.5 degrees) is not mentioned."""
    (first_plus, first_minus), (second_plus, second_minus) = END_WORD_KEYS[plane]
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    second_word = words[second_plus if s > 0 else second_minus]
    first_word = words[first_plus if c > 0 else first_minus]
    if abs(s) > 0.2 and abs(c) > 0.2:
        return words.fill("end_both", {"first": second_word, "second": first_word})
    return second_word if abs(s) > 0.2 else first_word
