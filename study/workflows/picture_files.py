"""Figures of a report as files: SVG for editing, PNG for slides."""

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
    """Write into `folder`, which is created: SVG, and PNG where the picture asks for it. Raises CannotWriteError."""
    drawn = map_forked(draw_picture, pictures)
    for picture, each in zip(pictures, drawn, strict=True):
        picture.drawn[:] = each.picture.drawn
    write_drawn(folder, drawn)


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPicture:
    """A drawn picture that can be sent from another process."""

    picture: Picture
    """With its SVG text; its figure is empty."""
    png: bytes


def draw_picture(picture: Picture) -> DrawnPicture:
    """Draw SVG and PNG; for a worker process."""
    svg, png = _draw_files(picture)
    picture.drawn[:] = [svg]
    return DrawnPicture(without_figure(picture), png)


def _draw_files(picture: Picture) -> tuple[str, bytes]:
    return picture_svg(picture), _png(picture) if picture.bitmap else b""


def write_drawn(folder: Path, drawn: Iterable[DrawnPicture]) -> None:
    """Write pictures that are drawn already, as `write_pictures`. Raises CannotWriteError."""
    try:
        make_folder(folder)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    for each in drawn:
        write_text(folder / f"{each.picture.name}.svg", picture_svg(each.picture), overwrite=True)
        if each.png:
            write_atomically(folder / f"{each.picture.name}.png", each.png, overwrite=True)


def _png(picture: Picture) -> bytes:
    drawn = io.BytesIO()
    # Without the version of matplotlib in the file, the same data give the same file.
    picture.figure.savefig(drawn, format="png", dpi=FIGURE_DPI, metadata={"Software": None})
    return drawn.getvalue()
