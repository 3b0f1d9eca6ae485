"""Pictures of a report as files beside it: SVG for an editor, PNG for slides."""

import io
from collections.abc import Sequence
from pathlib import Path

from analysis.figures.picture import Picture, picture_svg
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.privacy import make_folder
from study.store.disk.text_file import write_text
from study.workflows.forked_map import forked_map

FIGURE_DPI = 150


def write_pictures(folder: Path, pictures: Sequence[Picture]) -> None:
    """Into `folder`, which is made. Folded pictures are too many for slides: SVG only. Raises CannotWriteError."""
    try:
        make_folder(folder)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    drawn = forked_map(_drawn, pictures)
    for picture, (svg, png) in zip(pictures, drawn, strict=True):
        picture.drawn[:] = [svg]
        write_text(folder / f"{picture.name}.svg", svg, overwrite=True)
        if png:
            write_atomically(folder / f"{picture.name}.png", png, overwrite=True)


def _drawn(picture: Picture) -> tuple[str, bytes]:
    return picture_svg(picture), b"" if picture.folded else _png(picture)


def _png(picture: Picture) -> bytes:
    drawn = io.BytesIO()
    # Without the version of matplotlib in the file, the same data give the same file.
    picture.figure.savefig(drawn, format="png", dpi=FIGURE_DPI, metadata={"Software": None})
    return drawn.getvalue()
