"""Parametrisation of a mechanical model: masses, dampers and springs at the driven axes, and oscillators on them.

M a + D v + K x = u at the m driven axes. An oscillator with frequency w, damping ratio d and participation vector L
(root of its mass times its direction) has the relative coordinate e: e'' + 2 d w e' + w² e = -Lᵀ a. Responses are a
linear combination of the driven axes' motions (rows of `output`) and the oscillators' (sensor shapes). An elastic joint
may connect the driven axes to the body that carries sensors and oscillators; see `insert_joint`. Bounds of the fit are
chosen.
"""

from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
import numpy.typing as npt

from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, SensorLimits
from equalizer.signals.signal import FloatArray

DRIVEN_SHARE = 0.5
"""Fraction of the mass without oscillators that is assumed on the driven side of an elastic joint. Chosen."""


def insert_joint(model: MechanicalModel, m: int, stiffness: FloatArray, loss_s: float) -> MechanicalModel:
    """Insert an elastic joint (a cable, a belt, a flexible link) behind the m driven axes. model: coordinates
    of the driven axes, then of oscillators. Result: driven axes, axes beyond the joint, oscillators relative to the
    latter. stiffness: (m, m), N/m or N m/rad, positive definite. loss_s: the joint's damping over its stiffness (s).

    Dampers and springs to the ground stay on the driven axes, where the drives are. From force to response the total
    mass and the joint's resonance are identifiable, but not `DRIVEN_SHARE`, the distribution of the mass.
    """
    participation = model.mass[m:, :m]
    bare_mass = model.mass[:m, :m] - participation.T @ participation
    n = model.coordinates + m
    mass, damping, springs = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    mass[m:, m:] = model.mass
    mass[m : 2 * m, m : 2 * m] -= DRIVEN_SHARE * bare_mass
    mass[:m, :m] = DRIVEN_SHARE * bare_mass
    for matrix, part in ((damping, model.damping), (springs, model.stiffness)):
        matrix[:m, :m] = part[:m, :m]
        matrix[2 * m :, 2 * m :] = part[m:, m:]
    for matrix, part in ((damping, loss_s * stiffness), (springs, stiffness)):
        matrix[: 2 * m, : 2 * m] += np.block([[part, -part], [-part, part]])
    return replace(
        model,
        mass=mass,
        damping=damping,
        stiffness=springs,
        input=np.vstack([model.input[:m], np.zeros((n - m, m))]),
        output=np.hstack([np.zeros((model.outputs, m)), model.output]),
    )


_LARGEST_MASS_LOG = 12.0
"""Largest magnitude of the logarithms on the diagonal of the mass's Cholesky factor."""
_LARGEST_MODE_RATIO = 4.0
"""Largest factor by which a mode's frequency may lie below or above the band."""
_LARGEST_ROTATION_RAD = 0.3
"""Largest rotation of the sensor, rad."""
_MAX_DELAY_SAMPLES = 200.0
"""Largest delay of the command, samples."""
_LARGEST_JOINT_LOG = 2.5
"""Bound of the logarithms on the diagonal of the joint stiffness's Cholesky factor, about their value for a resonance
at the band's upper end."""
_JOINT_LOSS_FACTOR = 0.05
"""Starting loss factor of the joint at its resonance. Heuristic."""


@dataclass(frozen=True, eq=False)
class Structure:
    """The parts of a model. Its unknowns are a vector (`parameters`,), scaled to the order of 1; see `slices`."""

    inputs: int
    outputs: int
    """Number of responses; the first `inputs` of them are the driven axes' own motions."""
    quantity: str
    mass_scale: float
    speed_scale: float
    """rad/s: keeps the logarithms of frequencies near 0."""
    signs: tuple[float, ...]
    """Sign of each driven axis's own sensor: -1 where it is positive in the direction opposite to the command."""
    modes: int = 0
    grounded: bool = True
    """Whether there may be springs to the ground."""
    rotated_sensor: bool = False
    """Whether the sensor's axes may be rotated against the commands' by a small angle."""
    shared_sensors: bool = False
    """Whether the sensors of the driven axes also measure a share of the oscillators' motion."""
    joint: bool = False
    """Whether an elastic joint, such as cables, connects the driven axes to all other bodies."""
    delayed: bool = False  # whether the delay is fitted
    step_s: float = 1e-3
    sensor: SensorLimits = field(default_factory=SensorLimits)
    actuator: ActuatorLimits = field(default_factory=ActuatorLimits)
    rotational: bool = False

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Slices of the vector of unknowns, in its order: Cholesky factors of mass, damping and stiffness, output rows
        of the further sensors, rotation, joint, delay; then per mode the logarithms of frequency and damping ratio, the
        participations, the sensor shape. Slices of parts that the structure lacks are empty."""
        m, p = self.inputs, self.outputs
        pair_count = m * (m + 1) // 2
        shape_entries = p if self.shared_sensors else p - m
        sizes = {
            "mass": pair_count, "damping": pair_count, "stiffness": pair_count if self.grounded else 0,
            "rows": (p - m) * m, "turn": m * (m - 1) // 2 if self.rotated_sensor else 0,
            "joint": pair_count + 1 if self.joint else 0, "delay": 1 if self.delayed else 0,
            "modes": self.modes * (2 + m + shape_entries),
        }  # fmt: skip
        ends = np.cumsum(list(sizes.values()))
        return {name: slice(int(end) - size, int(end)) for (name, size), end in zip(sizes.items(), ends, strict=True)}

    @property
    def parameters(self) -> int:
        """Number of unknowns."""
        return int(self.slices["modes"].stop)

    @property
    def coordinates(self) -> int:
        """Number of the model's coordinates: driven axes, as many beyond a joint, and a coordinate per mode."""
        return (2 if self.joint else 1) * self.inputs + self.modes

    @property
    def units(self) -> tuple[float, float, float]:
        """Units (scales) of mass, damping and stiffness."""
        return self.mass_scale, self.mass_scale * self.speed_scale, self.mass_scale * self.speed_scale**2

    def convert_unknowns(self, unknowns: FloatArray, destination: "Structure") -> FloatArray:
        """Convert unknowns to a structure with as many modes or more; parts it adds are 0, parts it lacks dropped."""
        converted = np.zeros(destination.parameters)
        for name, source_slice in self.slices.items():
            target_slice = destination.slices[name]
            if name == "modes" and self.modes:
                old_modes = unknowns[source_slice].reshape(self.modes, -1)
                new_modes = np.zeros((destination.modes, (target_slice.stop - target_slice.start) // destination.modes))
                split = 2 + self.inputs
                new_modes[: self.modes, :split] = old_modes[:, :split]
                if old_modes.shape[1] > split:
                    new_modes[: self.modes, new_modes.shape[1] - (old_modes.shape[1] - split) :] = old_modes[:, split:]
                converted[target_slice] = new_modes.ravel()
            elif name != "modes" and source_slice.stop - source_slice.start == target_slice.stop - target_slice.start:
                converted[target_slice] = unknowns[source_slice]
        return converted

    def build_model(self, unknowns: FloatArray, name: str = "fitted") -> MechanicalModel:
        """Build the model in relative coordinates. Raises MechanicalModelError unless the mass is positive definite."""
        m, slices = self.inputs, self.slices
        mass, damping, stiffness = self.compute_axis_matrices(unknowns)
        frequency, ratio, participation, sensor_shapes = self.unpack_oscillators(unknowns)
        sensor_rotation = np.diag(self.signs) @ _compute_rotation(unknowns[slices["turn"]], m)
        rows = np.concatenate([sensor_rotation, unknowns[slices["rows"]].reshape(-1, m)])
        model = MechanicalModel(
            name=name,
            quantity=self.quantity,
            mass=_assemble_matrix(mass + participation.T @ participation, participation, np.ones(self.modes)),
            damping=_assemble_matrix(damping, None, 2 * ratio * frequency),
            stiffness=_assemble_matrix(stiffness, None, frequency**2),
            input=np.concatenate([np.eye(m), np.zeros((self.modes, m))]),
            output=np.concatenate([rows, sensor_shapes.T], axis=1),
            sensor=self.sensor,
            actuator=replace(self.actuator, delay_s=self.unpack_delay_s(unknowns)),
            rotational=self.rotational,
        )
        if not self.joint:
            return model
        joint = unknowns[slices["joint"]]
        lower = _unpack_log_triangle(joint[:-1], m)
        return insert_joint(model, m, self.units[2] * lower @ lower.T, float(np.exp(joint[-1])) / self.speed_scale)

    def compute_axis_matrices(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Compute mass (without the oscillators'), damping and stiffness at the driven axes, (m, m) each."""
        m, slices, units = self.inputs, self.slices, self.units
        lower = _unpack_log_triangle(unknowns[slices["mass"]], m)
        stiffness = units[2] * _unpack_square(unknowns[slices["stiffness"]], m) if self.grounded else np.zeros((m, m))
        return units[0] * lower @ lower.T, units[1] * _unpack_square(unknowns[slices["damping"]], m), stiffness

    def compute_bounds(self, band_hz: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
        """Compute lower and upper bounds (parameters,), such as: no negative diagonal in the factors of damping and
        stiffness, damping ratios 1e-4 to 3, the joint's damping over its stiffness 1e-4 to 1 over speed_scale."""
        lower, upper = np.full(self.parameters, -np.inf), np.full(self.parameters, np.inf)
        slices, diagonal = self.slices, find_diagonal_indices(self.inputs)
        for name in ("damping", "stiffness"):
            if slices[name].stop > slices[name].start:
                lower[slices[name].start + diagonal] = 0.0
        lower[slices["mass"].start + diagonal], upper[slices["mass"].start + diagonal] = (
            -_LARGEST_MASS_LOG,
            _LARGEST_MASS_LOG,
        )
        if self.joint:
            indices = slices["joint"].start + diagonal
            joint_log = np.log(2 * np.pi * band_hz[1] / self.speed_scale)
            lower[indices], upper[indices] = joint_log - _LARGEST_JOINT_LOG, joint_log + _LARGEST_JOINT_LOG
            lower[slices["joint"].stop - 1], upper[slices["joint"].stop - 1] = np.log(1e-4), np.log(1.0)
        lower[slices["turn"]], upper[slices["turn"]] = -_LARGEST_ROTATION_RAD, _LARGEST_ROTATION_RAD
        lower[slices["delay"]], upper[slices["delay"]] = 0.0, _MAX_DELAY_SAMPLES
        if self.modes:
            mode_size = (slices["modes"].stop - slices["modes"].start) // self.modes
            indices = slices["modes"].start + mode_size * np.arange(self.modes)
            lower[indices] = np.log(2 * np.pi * band_hz[0] / _LARGEST_MODE_RATIO / self.speed_scale)
            upper[indices] = np.log(2 * np.pi * band_hz[1] * _LARGEST_MODE_RATIO / self.speed_scale)
            lower[indices + 1], upper[indices + 1] = np.log(1e-4), np.log(3.0)
        return lower, upper

    def unpack_delay_s(self, unknowns: FloatArray) -> float:
        """Unpack the delay of the command (s), not negative: fitted where `delayed`, else that of `actuator`."""
        if not self.delayed:
            return self.actuator.delay_s
        return max(float(unknowns[self.slices["delay"]][0]) * self.step_s, 0.0)

    def unpack_oscillators(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Unpack frequencies (modes,), rad/s, damping ratios (modes,), participations (modes, m), shapes (modes, p)."""
        m, p = self.inputs, self.outputs
        rows = unknowns[self.slices["modes"]].reshape(self.modes, -1) if self.modes else np.zeros((0, 2 + m))
        root_mass = np.sqrt(self.mass_scale)
        shapes = np.zeros((self.modes, p))
        if self.modes and rows.shape[1] > 2 + m:
            shapes[:, p - (rows.shape[1] - 2 - m) :] = rows[:, 2 + m :] / root_mass
        return self.speed_scale * np.exp(rows[:, 0]), np.exp(rows[:, 1]), root_mass * rows[:, 2 : 2 + m], shapes


def pack_mass(mass: FloatArray) -> FloatArray:
    """Pack a mass (m, m), positive definite, in units of `mass_scale`, as unknowns: its Cholesky factor, with the
    logarithm of the diagonal."""
    lower = np.linalg.cholesky(mass)
    np.fill_diagonal(lower, np.log(np.diag(lower)))
    return np.asarray(lower[_list_triangle_indices(len(mass))])


def pack_square_root(matrix: FloatArray) -> FloatArray:
    """Pack a damping or stiffness (m, m), positive definite, in the structure's units: its Cholesky factor, so
    that the matrix stays positive semidefinite (passive)."""
    return np.asarray(np.linalg.cholesky(matrix)[_list_triangle_indices(len(matrix))])


def start_joint(structure: Structure, unknowns: FloatArray, frequency_hz: float) -> FloatArray:
    """Start the unknowns with an isotropic joint whose resonance, for the mean mass of the axes, is at frequency_hz."""
    mass = structure.compute_axis_matrices(unknowns)[0]
    m, joint_slice = structure.inputs, structure.slices["joint"]
    reduced_mass = float(np.trace(mass)) / m * DRIVEN_SHARE * (1 - DRIVEN_SHARE)
    start = unknowns.copy()
    start[joint_slice] = 0.0
    stiffness_root = 2 * np.pi * frequency_hz * np.sqrt(reduced_mass / structure.units[2])
    start[joint_slice.start + find_diagonal_indices(m)] = np.log(stiffness_root)
    start[joint_slice.stop - 1] = np.log(_JOINT_LOSS_FACTOR * structure.speed_scale / (2 * np.pi * frequency_hz))
    return start


def remove_mode(structure: Structure, unknowns: FloatArray, mode_index: int) -> tuple[Structure, FloatArray]:
    """Remove the mode `mode_index` (from 0); returns the structure and the unknowns without it."""
    mode_slice = structure.slices["modes"]
    rows = np.delete(unknowns[mode_slice].reshape(structure.modes, -1), mode_index, axis=0)
    return replace(structure, modes=structure.modes - 1), np.concatenate([unknowns[: mode_slice.start], rows.ravel()])


def find_diagonal_indices(m: int) -> npt.NDArray[np.intp]:
    """Find the indices (m,) of the diagonal entries in the row-by-row lower triangle of an m x m matrix."""
    rows, columns = _list_triangle_indices(m)
    return np.flatnonzero(rows == columns)


@cache
def _list_triangle_indices(m: int) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """List rows and columns of the lower triangle, row by row. Cached: a fit calls this some ten thousand times."""
    return np.tril_indices(m)


def _unpack_log_triangle(unknowns: FloatArray, m: int) -> FloatArray:
    """Unpack a Cholesky factor (m, m) from its lower triangle, row by row, with the logarithms of its diagonal."""
    lower = np.zeros((m, m))
    lower[_list_triangle_indices(m)] = unknowns
    np.fill_diagonal(lower, np.exp(np.diag(lower)))
    return lower


def _unpack_square(unknowns: FloatArray, m: int) -> FloatArray:
    """Unpack a matrix (m, m) from the lower triangle of its Cholesky factor, row by row."""
    lower = np.zeros((m, m))
    lower[_list_triangle_indices(m)] = unknowns
    return np.asarray(lower @ lower.T)


def _compute_rotation(angles: FloatArray, m: int) -> FloatArray:
    """Compute a rotation (m, m) as the Cayley transform of a skew-symmetric matrix of small angles (rad)."""
    if not len(angles):
        return np.eye(m)
    skew = np.zeros((m, m))
    skew[np.tril_indices(m, -1)] = angles / 2
    skew = skew - skew.T
    return np.asarray(np.linalg.solve(np.eye(m) - skew, np.eye(m) + skew))


def _assemble_matrix(driven: FloatArray, coupling: FloatArray | None, diagonal: FloatArray) -> FloatArray:
    """Assemble a matrix of the driven axes (m, m), then the oscillators. diagonal: (modes,), coupling: (modes, m)."""
    m, n = len(driven), len(driven) + len(diagonal)
    matrix = np.zeros((n, n))
    matrix[:m, :m] = driven
    matrix[range(m, n), range(m, n)] = diagonal
    if coupling is not None:
        matrix[m:, :m], matrix[:m, m:] = coupling, coupling.T
    return matrix
