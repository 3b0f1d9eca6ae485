"""Figures of a report as files: SVG for editing, PNG for slides.

Figures are drawn in parallel processes (`forked_map`). The same data give the same files: neither format contains a
date or the version of Matplotlib.
"""

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.figures.picture import Picture, picture_svg, without_figure
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.privacy import make_folder
from study.store.disk.text_file import write_text
from study.workflows.forked_map import map_forked

FIGURE_DPI = 150
"""Resolution of PNG files (dots per inch)."""


def write_pictures(folder: Path, pictures: Sequence[Picture]) -> None:
    """Draw the pictures and write them into `folder`, which is created if necessary: an SVG file each, and a PNG file
    where `Picture.bitmap` is set. Existing files are replaced. Raises CannotWriteError."""
    drawn = map_forked(draw_picture, pictures)
    for picture, each in zip(pictures, drawn, strict=True):
        picture.drawn[:] = each.picture.drawn
    write_drawn(folder, drawn)


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPicture:
    """A picture as drawn in a worker process, without its Matplotlib figure, so that it can be sent between
    processes."""

    picture: Picture
    """Picture with its SVG text and an empty figure."""
    png: bytes
    """Content of the PNG file; empty if the picture is only written as SVG."""


def draw_picture(picture: Picture) -> DrawnPicture:
    """Draw a picture as SVG and, where `Picture.bitmap` is set, as PNG. Runs in a worker process."""
    svg, png = _draw_files(picture)
    picture.drawn[:] = [svg]
    return DrawnPicture(without_figure(picture), png)


def _draw_files(picture: Picture) -> tuple[str, bytes]:
    """Text of the SVG file and content of the PNG file; the latter is empty unless `Picture.bitmap` is set."""
    return picture_svg(picture), _png(picture) if picture.bitmap else b""


def write_drawn(folder: Path, drawn: Iterable[DrawnPicture]) -> None:
    """Write pictures that are already drawn into `folder`, as `write_pictures` does. Raises CannotWriteError."""
    try:
        make_folder(folder)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    for each in drawn:
        write_text(folder / f"{each.picture.name}.svg", picture_svg(each.picture), overwrite=True)
        if each.png:
            write_atomically(folder / f"{each.picture.name}.png", each.png, overwrite=True)


def _png(picture: Picture) -> bytes:
    """Content of the PNG file at `FIGURE_DPI`."""
    drawn = io.BytesIO()
    # Without the version of matplotlib in the file, the same data give the same file.
    picture.figure.savefig(drawn, format="png", dpi=FIGURE_DPI, metadata={"Software": None})
    return drawn.getvalue()
