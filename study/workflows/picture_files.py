"""Write the figures of a report as files: SVG for editing, PNG for slides.

Figures are drawn in parallel processes (`forked_map`). So that the same data give the same files, neither format
contains a date or the version of Matplotlib.
"""

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.figures.picture import Picture, remove_figure, render_picture_svg
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import convert_write_errors
from study.store.disk.privacy import make_folder
from study.store.disk.text_file import write_text
from study.workflows.forked_map import map_forked

FIGURE_DPI = 150
"""Resolution of PNG files (dots per inch). Chosen for slides."""


def write_pictures(folder: Path, pictures: Sequence[Picture]) -> None:
    """Draw the pictures and write them into `folder`, which is created if necessary: an SVG file each, and a PNG file
    where `Picture.bitmap` is set. Existing files are replaced. The SVG texts are kept in `pictures`, for the report.
    Raises CannotWriteError where a file cannot be written."""
    drawn_pictures = map_forked(draw_picture, pictures)
    for picture, drawn_picture in zip(pictures, drawn_pictures, strict=True):
        picture.rendered_svg[:] = drawn_picture.picture.rendered_svg
    write_drawn_pictures(folder, drawn_pictures)


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPicture:
    """A drawn picture without its Matplotlib figure, so that it can be sent between processes."""

    picture: Picture
    """Picture with its SVG text and an empty figure."""
    png: bytes
    """Content of the PNG file; empty if the picture is only written as SVG."""


def draw_picture(picture: Picture) -> DrawnPicture:
    """Draw a picture as SVG and, where `Picture.bitmap` is set, as PNG."""
    svg, png = _render_svg_and_png(picture)
    picture.rendered_svg[:] = [svg]
    return DrawnPicture(remove_figure(picture), png)


def _render_svg_and_png(picture: Picture) -> tuple[str, bytes]:
    """Render the text of the SVG file and the content of the PNG file, which may be empty (`DrawnPicture`)."""
    return render_picture_svg(picture), _render_png(picture) if picture.bitmap else b""


def write_drawn_pictures(folder: Path, drawn_pictures: Iterable[DrawnPicture]) -> None:
    """Write drawn pictures into `folder`, as `write_pictures` does. Raises CannotWriteError where a file cannot be
    written."""
    with convert_write_errors(folder):
        make_folder(folder)
    for drawn_picture in drawn_pictures:
        write_text(
            folder / f"{drawn_picture.picture.name}.svg", render_picture_svg(drawn_picture.picture), overwrite=True
        )
        if drawn_picture.png:
            write_atomically(folder / f"{drawn_picture.picture.name}.png", drawn_picture.png, overwrite=True)


def _render_png(picture: Picture) -> bytes:
    """Render a figure as PNG at `FIGURE_DPI`."""
    buffer = io.BytesIO()
    picture.figure.savefig(buffer, format="png", dpi=FIGURE_DPI, metadata={"Software": None})
    return buffer.getvalue()
