"""Drawings and descriptions of the two directions between which a participant decides.

A direction is a line segment in a plane at an angle in degrees, counted from the plane's first axis towards its second;
it has no sign. The two segments differ in number, position and line style, not in
colour, so that they can be distinguished on every terminal. They are drawn with Braille dots (2 x 4 per character).
"""

import math
from functools import lru_cache

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.views import DirectionPicture
from study.tui.drawing.braille import Canvas

ENDS = {
    "yz": (("end_right", "end_left"), ("end_up", "end_down")),
    "xy": (("end_toward", "end_away"), ("end_right", "end_left")),
    "zx": (("end_up", "end_down"), ("end_toward", "end_away")),
}
"""Keys of the words for the positive and the negative end of a plane's first and second axis."""

SCREEN = {"yz": ((1, 0), (0, 1)), "xy": ((0, -1), (1, 0)), "zx": ((0, 1), (1, 0))}
"""Where a plane's first and second axis point on the screen: (right, up). With x towards the operator, y to the right
and z up, 'yz' is seen from the operator's side, 'xy' from above, and 'zx' from the left."""


def sentence(picture: DirectionPicture, number: int, words: Words = ENGLISH_WORDS) -> str:
    """A direction in words with its number (1 or 2), such as "1: up-left to down-right"."""
    return words.fill("direction", {"number": number, "ends": ends(picture, number, words)})


def ends(picture: DirectionPicture, number: int, words: Words = ENGLISH_WORDS) -> str:
    """Both ends of a direction (1 or 2) in words, such as "up-left to down-right"."""
    angle = picture.angle_deg[number - 1]
    start, end = _end_text(picture.plane, angle, words), _end_text(picture.plane, angle + 180, words)
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
    unit_right, unit_up = _on_screen(picture.plane, picture.angle_deg[number - 1])
    x, y = canvas.middle
    reach = _half_length(picture, x, y)
    thick = max(2.5, reach / 8)
    head = 2.6 * thick
    shaft = reach - head

    def canvas_point(distance: float, offset: float = 0.0) -> tuple[float, float]:
        # Point of the canvas from coordinates along and across the segment; y of the canvas points downwards.
        return x + distance * unit_right + offset * unit_up, y - distance * unit_up + offset * unit_right

    for side in (-1, 1):
        base = side * shaft
        canvas.fill((canvas_point(side * reach), canvas_point(base, 1.5 * thick), canvas_point(base, -1.5 * thick)))
    for dash_start, dash_end in ((-shaft, shaft),) if number == 1 else _dash_ends(shaft, 2.2 * thick, 1.1 * thick):
        canvas.stroke(canvas_point(dash_start), canvas_point(dash_end), thick)
    return tuple(canvas.lines())


def _half_length(picture: DirectionPicture, x: float, y: float) -> float:
    """Half length of a segment in dots, the same for both directions, so that neither looks stronger. x, y: half width
    and half height of the canvas."""
    sides = [_on_screen(picture.plane, angle) for angle in picture.angle_deg]
    longest = min(min(x / max(abs(unit_right), 1e-9), y / max(abs(unit_up), 1e-9)) for unit_right, unit_up in sides)
    return min(longest, 1.25 * min(x, y))


def _dash_ends(half_length: float, dash: float, gap: float) -> list[tuple[float, float]]:
    """Begin and end of each dash along the segment from -half_length to half_length, evenly spaced, with a gap at both
    ends. dash, gap: desired lengths, stretched so that a whole number of dashes fits."""
    count = max(1, round((2 * half_length - gap) / (dash + gap)))
    stretch = 2 * half_length / (count * dash + (count + 1) * gap)
    starts = [-half_length + stretch * (gap + i * (dash + gap)) for i in range(count)]
    return [(start, start + stretch * dash) for start in starts]


def _draw_direction(plane: str, angle_deg: float, columns: int, rows: int, dashed: bool) -> list[str]:
    """Lines of text with a thin segment, with two barbs at each end."""
    canvas = Canvas(columns, rows)
    unit_right, unit_up = _on_screen(plane, angle_deg)
    cx, cy = (canvas.width - 1) / 2, (canvas.height - 1) / 2
    reach = 0.95 * min(cx, cy)
    start, end = (cx - reach * unit_right, cy + reach * unit_up), (cx + reach * unit_right, cy - reach * unit_up)
    canvas.line(start, end, dashed)
    for tip, turn in ((start, 180.0), (end, 0.0)):
        for spread in (150.0, -150.0):
            heading = math.degrees(math.atan2(unit_up, unit_right)) + turn + spread
            h = math.radians(heading)
            barb = (tip[0] + 5 * math.cos(h), tip[1] - 5 * math.sin(h))
            canvas.line(tip, barb)
    return canvas.lines()


def _on_screen(plane: str, angle_deg: float) -> tuple[float, float]:
    """Unit vector of a direction on the screen, (right, up)."""
    first, second = SCREEN[plane]
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return c * first[0] + s * second[0], c * first[1] + s * second[1]


def _end_text(plane: str, angle_deg: float, words: Words) -> str:
    """One end of a direction in words; a component of at most 0.2 (about 11.5 degrees) is not mentioned."""
    (first_plus, first_minus), (second_plus, second_minus) = ENDS[plane]
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    second_word = words[second_plus if s > 0 else second_minus]
    first_word = words[first_plus if c > 0 else first_minus]
    if abs(s) > 0.2 and abs(c) > 0.2:
        return words.fill("end_both", {"first": second_word, "second": first_word})
    return second_word if abs(s) > 0.2 else first_word
