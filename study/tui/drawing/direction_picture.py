"""Drawings and descriptions of the two directions between which a participant decides.

A direction is a line segment in a plane at an angle in degrees, counted from the plane's first axis towards its second;
it has no sign. The two segments differ in angle and line style, not in colour, so that they can be distinguished on a
terminal without colours. Proportions of segments, arrowheads, dashes and barbs are chosen by hand.
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
"""Directions (right, up) of a plane's first and second axis on the screen. With x towards the operator, y to the right
and z up, 'yz' is seen from the operator's side, 'xy' from above, and 'zx' from the left."""


def describe_direction(picture: DirectionPicture, number: int, words: Words = ENGLISH_WORDS) -> str:
    """Describe a direction in words with its number (1 or 2), such as "1: up-left to down-right"."""
    return words.fill("direction", {"number": number, "ends": describe_direction_ends(picture, number, words)})


def describe_direction_ends(picture: DirectionPicture, number: int, words: Words = ENGLISH_WORDS) -> str:
    """Describe both ends of a direction (1 or 2) in words, such as "up-left to down-right"."""
    angle = picture.angle_deg[number - 1]
    start, end = _describe_end(picture.plane, angle, words), _describe_end(picture.plane, angle + 180, words)
    return words.fill("direction_ends", {"start": start, "end": end})


def draw_directions(picture: DirectionPicture, columns: int = 18, rows: int = 9) -> list[str]:
    """Draw both directions side by side as lines of text: 1 solid, 2 dashed, each with its number below. columns, rows:
    size of each drawing in characters."""
    first_lines = _draw_direction(picture.plane, picture.angle_deg[0], columns, rows, dashed=False)
    second_lines = _draw_direction(picture.plane, picture.angle_deg[1], columns, rows, dashed=True)
    number_line = f"{'1'.center(columns)}    {'2'.center(columns)}"
    return [
        f"{first_line}    {second_line}".rstrip()
        for first_line, second_line in zip(first_lines, second_lines, strict=True)
    ] + [number_line.rstrip()]


@lru_cache(maxsize=64)
def draw_large_direction(picture: DirectionPicture, number: int, columns: int, rows: int) -> tuple[str, ...]:
    """Draw one direction (1 or 2) in columns x rows characters: a thick segment with an arrowhead at both ends; 1
    solid, 2 dashed. Its length: `_compute_half_length`."""
    canvas = Canvas(columns, rows)
    unit_right, unit_up = _project_to_screen(picture.plane, picture.angle_deg[number - 1])
    centre_x, centre_y = canvas.centre
    half_length = _compute_half_length(picture, centre_x, centre_y)
    thickness = max(2.5, half_length / 8)
    head_length = 2.6 * thickness
    shaft_half_length = half_length - head_length

    def convert_to_canvas(distance: float, offset: float = 0.0) -> tuple[float, float]:
        """Convert coordinates along and across the segment (dots) to a point of the canvas, whose y points
        downwards."""
        return centre_x + distance * unit_right + offset * unit_up, centre_y - distance * unit_up + offset * unit_right

    for sign in (-1, 1):
        head_base = sign * shaft_half_length
        canvas.fill_polygon(
            (
                convert_to_canvas(sign * half_length),
                convert_to_canvas(head_base, 1.5 * thickness),
                convert_to_canvas(head_base, -1.5 * thickness),
            )
        )
    for dash_start, dash_end in (
        ((-shaft_half_length, shaft_half_length),)
        if number == 1
        else _compute_dash_bounds(shaft_half_length, 2.2 * thickness, 1.1 * thickness)
    ):
        canvas.draw_bar(convert_to_canvas(dash_start), convert_to_canvas(dash_end), thickness)
    return tuple(canvas.render_lines())


def _compute_half_length(picture: DirectionPicture, half_width: float, half_height: float) -> float:
    """Compute the half length of a segment in dots: the largest at which both directions fit into the canvas, at most
    1.25 times its smaller half side, and the same for both, so that neither looks stronger. half_width, half_height: of
    the canvas (dots). 1e-9 avoids a division by 0."""
    unit_vectors = [_project_to_screen(picture.plane, angle) for angle in picture.angle_deg]
    largest_half_length = min(
        min(half_width / max(abs(unit_right), 1e-9), half_height / max(abs(unit_up), 1e-9))
        for unit_right, unit_up in unit_vectors
    )
    return min(largest_half_length, 1.25 * min(half_width, half_height))


def _compute_dash_bounds(half_length: float, dash_length: float, gap_length: float) -> list[tuple[float, float]]:
    """Compute start and end of each dash along the segment from -half_length to half_length, evenly spaced, with a gap
    at both ends. dash_length, gap_length: desired lengths (dots), scaled so that a whole number of dashes fits."""
    dash_count = max(1, round((2 * half_length - gap_length) / (dash_length + gap_length)))
    stretch = 2 * half_length / (dash_count * dash_length + (dash_count + 1) * gap_length)
    starts = [
        -half_length + stretch * (gap_length + dash_index * (dash_length + gap_length))
        for dash_index in range(dash_count)
    ]
    return [(start, start + stretch * dash_length) for start in starts]


def _draw_direction(plane: str, angle_deg: float, columns: int, rows: int, dashed: bool) -> list[str]:
    """Draw a thin segment with an open arrowhead (two barbs of 5 dots at 30 degrees) at both ends, as lines of text."""
    canvas = Canvas(columns, rows)
    unit_right, unit_up = _project_to_screen(plane, angle_deg)
    centre_x, centre_y = (canvas.width - 1) / 2, (canvas.height - 1) / 2
    half_length = 0.95 * min(centre_x, centre_y)
    start, end = (
        (centre_x - half_length * unit_right, centre_y + half_length * unit_up),
        (centre_x + half_length * unit_right, centre_y - half_length * unit_up),
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
    """Project the unit vector of a direction to the screen, (right, up)."""
    first_axis, second_axis = SCREEN_AXES[plane]
    cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return cosine * first_axis[0] + sine * second_axis[0], cosine * first_axis[1] + sine * second_axis[1]


def _describe_end(plane: str, angle_deg: float, words: Words) -> str:
    """Describe one end of a direction in words; a component of at most 0.2, chosen (an angle of 11.5 degrees), is not
    mentioned."""
    (first_plus, first_minus), (second_plus, second_minus) = END_WORD_KEYS[plane]
    first_component, second_component = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    second_word = words[second_plus if second_component > 0 else second_minus]
    first_word = words[first_plus if first_component > 0 else first_minus]
    if abs(second_component) > 0.2 and abs(first_component) > 0.2:
        return words.fill("end_both", {"first": second_word, "second": first_word})
    return second_word if abs(second_component) > 0.2 else first_word
