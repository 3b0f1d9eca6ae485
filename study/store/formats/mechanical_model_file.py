"""Read and write mechanical models as TOML files: mass, damping and stiffness matrices, sensor, actuator, effects.

This module handles the file and describes its keys; `equalizer.plant.mechanical_model_toml` converts the text.
"""

from pathlib import Path

from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.plant.mechanical_model_toml import format_mechanical_model, parse_mechanical_model
from study.store.disk.file_errors import convert_problems
from study.store.disk.layout import Entry
from study.store.disk.text_file import read_toml_text, write_text

KIND = "mechanical model"
"""Name of this kind of file in messages."""

LAYOUT = (
    Entry("model.name", "text", "description of what is modelled"),
    Entry(
        "model.quantity",
        "text",
        "quantity of the response: " + ", ".join(f"`{word}`" for word in DERIVATIVE_OF_QUANTITY),
    ),
    Entry("model.mass", "n rows of n", "mass matrix, symmetric and positive definite; kg"),
    Entry("model.damping", "n rows of n", "damping matrix; N s/m"),
    Entry("model.stiffness", "n rows of n", "stiffness matrix; N/m"),
    Entry("model.input", "n rows of m", "coordinate that each command drives"),
    Entry(
        "model.output",
        "p rows of n",
        "coordinates that each response measures; the same rows give the recorded position",
    ),
    Entry(
        "model.rotational", "true or false", "if true: kg m^2, N m s/rad, N m/rad in place of the above units", False
    ),
    Entry(
        "sensor.bandwidth_hz", "number", "one pole per channel: y += (1 - exp(-2 pi f / rate)) (x - y); 0 = none", False
    ),
    Entry("sensor.range", "number", "largest magnitude, in the response's SI unit; 0 = none", False),
    Entry("actuator.delay_s", "number", "delay; 0 = none", False),
    Entry("actuator.bandwidth_hz", "number", "bandwidth of one pole; 0 = none", False),
    Entry("actuator.limit", "number", "largest force or torque; 0 = none", False),
    Entry("effect.kind", "text", "name in the table of effects; one [[effect]] per effect", False),
    Entry("effect.axis", "text", "axis or channel; missing if the effect is common to all", False),
    Entry("effect.acts_on", "text", "for a `discovered_law`: force, command or response", False),
    Entry("effect.expression", "text", "for a `discovered_law`: its formula, see below", False),
    Entry("effect.…", "number", "each parameter of the effect, by its name", False),
    Entry("tolerance.mass_kg", "number", "standard deviation of the calibration at each driven axis", False),
    Entry("tolerance.damping_n_s_per_m", "number", "likewise", False),
    Entry("tolerance.stiffness_n_per_m", "number", "likewise", False),
    Entry("tolerance.modes", "number", "relative standard deviation of modal frequencies and masses", False),
    Entry("provenance.…", "anything", "versions, command, seeds, parents", False),
)
"""Keys of the file, as docs/formats.md lists them; n coordinates, m commands, p responses. The units are those where
`provenance.units`, which is not listed separately, states no others."""


def read_mechanical_model(path: Path | str) -> MechanicalModel:
    """Read a model. Raises CannotReadError where the file cannot be read as text, and UnusableFileError with the
    problems of its content."""
    path = Path(path)
    with convert_problems(path, KIND):
        return parse_mechanical_model(read_toml_text(path, KIND))


def write_mechanical_model(path: Path | str, model: MechanicalModel, *, overwrite: bool = False) -> None:
    """Write a model. Raises AlreadyExistsError where the file exists and `overwrite` is False, CannotWriteError where
    it cannot be written."""
    write_text(Path(path), format_mechanical_model(model), overwrite=overwrite)
