"""Pictures of a report as files beside it: SVG for an editor, PNG for slides."""

import io
from collections.abc import Sequence
from pathlib import Path

from analysis.figures.picture import Picture, picture_svg
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.privacy import make_folder
from study.store.disk.text_file import write_text

FIGURE_DPI = 150


def write_pictures(folder: Path, pictures: Sequence[Picture]) -> None:
    """Into `folder`, which is made. Folded pictures are too many for slides: SVG only. Raises CannotWriteError."""
    try:
        make_folder(folder)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    for picture in pictures:
        write_text(folder / f"{picture.name}.svg", picture_svg(picture), overwrite=True)
        if not picture.folded:
            write_atomically(folder / f"{picture.name}.png", _png(picture), overwrite=True)


def _png(picture: Picture) -> bytes:
    drawn = io.BytesIO()
    # Without the version of matplotlib in the file, the same data give the same file.
    picture.figure.savefig(drawn, format="png", dpi=FIGURE_DPI, metadata={"Software": None})
    return drawn.getvalue()
