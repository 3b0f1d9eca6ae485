"""Pictures of a report as files beside it: SVG for an editor, PNG for slides."""

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.figures.picture import Picture, picture_svg, without_figure
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.privacy import make_folder
from study.store.disk.text_file import write_text
from study.workflows.forked_map import forked_map

FIGURE_DPI = 150


def write_pictures(folder: Path, pictures: Sequence[Picture]) -> None:
    """Into `folder`, which is made. Folded pictures are too many for slides: SVG only. Raises CannotWriteError."""
    drawn = forked_map(drawn_picture, pictures)
    for picture, each in zip(pictures, drawn, strict=True):
        picture.drawn[:] = each.picture.drawn
    write_drawn(folder, drawn)


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPicture:
    """Can be sent from another process."""

    picture: Picture
    """Drawn; its figure is empty."""
    png: bytes


def drawn_picture(picture: Picture) -> DrawnPicture:
    svg, png = _drawn(picture)
    picture.drawn[:] = [svg]
    return DrawnPicture(without_figure(picture), png)


def _drawn(picture: Picture) -> tuple[str, bytes]:
    return picture_svg(picture), b"" if picture.folded else _png(picture)


def write_drawn(folder: Path, drawn: Iterable[DrawnPicture]) -> None:
    """As `write_pictures`."""
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
