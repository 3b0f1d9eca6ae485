"""Record of iterative learning control on a device, `*.repeats.json`: the format `hapteq-repeats`, version 1.

It is stored beside the table of learned forces, and contains the error of each play, and the trajectory, model and
device for which the forces were learned.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter

from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import read_record, write_json
from study.store.disk.provenance import Provenance

FORMAT, VERSION = "hapteq-repeats", 1
"""Name and version of the format."""
SUFFIX = ".repeats.json"
"""Suffix of the document, in place of that of the table of forces."""
KIND = "document of repeats"
"""Name of this kind of file in messages."""


@dataclass(frozen=True, slots=True)
class Repeats:
    """Content of the document. Errors are root mean squares in the band, as fractions of that of the reference
    trajectory. A play is one repetition of the whole trajectory; between two plays the forces are corrected."""

    trajectory_sha256: str
    """Of the samples of the reference trajectory and their rate."""
    model_sha256: str
    """Of the model file, or of the model files together."""
    forces_sha256: str
    """Of the table of forces beside this document."""
    device: str
    place_m: tuple[float, float, float]
    """Position of the handle in device coordinates at which the trajectory is played (m)."""
    band_hz: tuple[float, float]
    """Lowest and highest frequency at which errors are computed and corrected (Hz)."""
    errors: tuple[float, ...]
    """Measured errors, noise included, play by play; the first is that of the initial forces."""
    kept: int
    """Index (from 0) of the play whose forces are in the table."""
    noise_floor: float
    """Error that the sensor noise alone causes."""
    gains: tuple[float, ...]
    """Learning gain beta of each correction, before the limits of force and slew rate."""
    fitted: tuple[float, ...]
    """Factor by which the limits of force and slew rate reduced each correction; 1: not reduced."""
    verdict: str
    """Why the iteration ended: name of a `Verdict` of `equalizer.tracking.learning.iteration`, in lower case."""
    remark: str
    """Sentence on the corrections that these limits reduced; empty where they reduced none."""
    interrupted: bool
    """Whether the run was interrupted before its end."""


REPEATS_VALIDATOR: TypeAdapter[Repeats] = TypeAdapter(Repeats)
"""Validates the types of a document, and gives its JSON schema."""


def get_repeats_path(forces_path: Path) -> Path:
    """Get the path of the document that belongs to a table of forces: `NAME.repeats.json` for `NAME.csv`."""
    return forces_path.with_suffix(SUFFIX)


def read_repeats(path: Path) -> Repeats:
    """Read the document, without its provenance. Raises CannotReadError where the file cannot be read,
    UnusableFileError where it has another format or version, a wrong type, or a `kept` that is no index of `errors`."""
    repeats = read_record(path, FORMAT, VERSION, KIND, REPEATS_VALIDATOR)
    if not 0 <= repeats.kept < len(repeats.errors):
        raise UnusableFileError(path, KIND, (f"kept is {repeats.kept}, but there are {len(repeats.errors)} plays",))
    return repeats


def write_repeats(path: Path, repeats: Repeats, provenance: Provenance | None = None) -> None:
    """Write the document. Raises AlreadyExistsError where the file exists, CannotWriteError where it cannot be written,
    ValueError where a number is NaN or infinite."""
    write_json(path, FORMAT, VERSION, asdict(repeats), provenance)
