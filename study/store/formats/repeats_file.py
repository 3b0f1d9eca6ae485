"""`*.repeats.json` beside a table of forces: the format `hapteq-repeats`, version 1.

Record of iterative learning control on the device: the errors of each play, and for which trajectory, model and device
the forces were found, so that a later run continues from them only for the same.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import Provenance

FORMAT, VERSION = "hapteq-repeats", 1
SUFFIX = ".repeats.json"
"""In place of the suffix of the table of forces."""
KIND = "document of repeats"
"""What messages call such a file."""


@dataclass(frozen=True, slots=True)
class Repeats:
    """Errors are root mean squares in the band, relative to the wanted signal. A play is one repetition of the whole
    trajectory; a correction leads from one to the next."""

    trajectory_sha256: str
    """SHA-256 of the wanted samples and their rate."""
    model_sha256: str
    """SHA-256 of the model file, or of all model files together."""
    forces_sha256: str
    """SHA-256 of the table of forces beside this document."""
    device: str
    place_m: tuple[float, float, float]
    band_hz: tuple[float, float]
    errors: tuple[float, ...]
    """Measured errors, noise included, play by play; the first is that of the initial forces."""
    kept: int
    """Index of the play whose forces are in the table, from 0."""
    noise_floor: float
    """Error due to the sensor's noise alone."""
    gains: tuple[float, ...]
    """Share of each error that was corrected."""
    fitted: tuple[float, ...]
    """Share of each correction that fits under the cap."""
    verdict: str
    remark: str
    interrupted: bool


REPEATS: TypeAdapter[Repeats] = TypeAdapter(Repeats)
"""Checks the document."""


def repeats_path(forces: Path) -> Path:
    """Path of the document beside a table of forces."""
    return forces.with_suffix(SUFFIX)


def read_repeats(path: Path) -> Repeats:
    """Read the document. Raises CannotReadError, UnusableFileError."""
    document = read_json(path, FORMAT, VERSION)
    document.pop("provenance", None)
    try:
        found = REPEATS.validate_python(document)
    except ValidationError as error:
        problems = tuple(f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors())
        raise UnusableFileError(path, KIND, problems) from error
    if not 0 <= found.kept < len(found.errors):
        raise UnusableFileError(path, KIND, (f"kept is {found.kept}, but there are {len(found.errors)} plays",))
    return found


def write_repeats(path: Path, repeats: Repeats, provenance: Provenance | None = None) -> None:
    """Write the document. Raises AlreadyThereError, CannotWriteError."""
    write_json(path, FORMAT, VERSION, asdict(repeats), provenance)
