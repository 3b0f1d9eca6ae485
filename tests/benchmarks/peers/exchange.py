"""What a runner reads and writes. Runs in the peers' environments too: numpy and the standard library only.

run_<peer>.py DATA.npz MODEL.npz OPTIONS_AS_JSON
"""

import json
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Data:
    """One continuous record: each axis sweeps its periods, one axis after the other; then rest."""

    rate_hz: float
    command: np.ndarray
    """(N, 3)"""
    response: np.ndarray
    """(N, 3)"""
    starts: np.ndarray
    stops: np.ndarray
    """Of each axis' sweeps, in samples."""
    period: int
    frequency_hz: np.ndarray
    """(lines,) of the estimate below, a little beyond the band."""
    estimate: np.ndarray
    """(lines, 3, 3), our estimate from whole periods: for peers that work on lines."""
    deviation: np.ndarray
    """(lines, 3, 3), its standard errors."""
    estimate_cpu_s: float
    band_hz: tuple[float, float]
    order: int


@dataclass(frozen=True)
class Model:
    """E x+ = A x + B u, y = C x + D u; continuous if rate_hz is 0."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    rate_hz: float
    E: np.ndarray | None = None
    uses_estimate: bool = False
    cpu_s: float = 0.0
    versions: dict[str, str] = field(default_factory=dict)


def decimated(data: Data, factor: int, part: slice = slice(None)) -> tuple[np.ndarray, np.ndarray, float]:
    """Command, response and their rate. Both sides through the same sharp filter without phase, so that the relation
    of one to the other stays what it was; the record ends at rest, so that its end does not leak into its beginning.
    All below the new Nyquist frequency is kept: where not even noise is left, a subspace method's spare poles go astray
    (measured: 1.9 in place of 0.97)."""
    both = np.hstack([data.command, data.response])
    spectrum = np.fft.rfft(both, axis=0)
    spectrum[np.fft.rfftfreq(len(both)) * factor >= 0.5] = 0.0
    few = np.fft.irfft(spectrum, len(both), axis=0)[::factor][part] if factor > 1 else both[part]
    return np.ascontiguousarray(few[:, :3]), np.ascontiguousarray(few[:, 3:]), data.rate_hz / factor


def input_matrices(data: Data, A: np.ndarray, C: np.ndarray, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Our B and D for a peer's A and C: weighted least squares on the lines of the estimate."""
    n, p = A.shape[0], C.shape[0]
    z = np.exp(2j * np.pi * data.frequency_hz / rate_hz)
    resolvent = z[:, None, None] * np.eye(n) - A.T
    states = np.linalg.solve(resolvent, np.broadcast_to(C.T.astype(complex), (len(z), n, p))).transpose(0, 2, 1)
    phi = np.concatenate([states, np.broadcast_to(np.eye(p), (len(z), p, p))], axis=2)
    solved = np.empty((n + p, data.estimate.shape[2]))
    for column in range(solved.shape[1]):
        weight = 1 / data.deviation[:, :, column]
        rows = (weight[:, :, None] * phi).reshape(-1, n + p)
        measured = (weight * data.estimate[:, :, column]).ravel()
        both, told = np.vstack([rows.real, rows.imag]), np.concatenate([measured.real, measured.imag])
        size = np.linalg.norm(both, axis=0)
        solved[:, column] = np.linalg.lstsq(both / size, told, rcond=1e-11)[0] / size
    return solved[:n], solved[n:]


def read_data(path: Path) -> Data:
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    low, high = arrays.pop("band_hz")
    scalars = {name: arrays.pop(name).item() for name in ("rate_hz", "period", "estimate_cpu_s", "order")}
    return Data(**arrays, **scalars, band_hz=(float(low), float(high)))


def read_model(path: Path) -> Model:
    with np.load(path) as file:
        descriptor = file["E"] if "E" in file.files else None
        told = json.loads(str(file["told"]))
        return Model(file["A"], file["B"], file["C"], file["D"], E=descriptor, **told)


def run(identify: Callable[[Data, dict], Model], packages: tuple[str, ...]) -> None:
    """CPU seconds are those of the whole process during `identify`; importing and reading are not counted."""
    data, options = read_data(Path(sys.argv[1])), json.loads(sys.argv[3])
    began_s = time.process_time()
    model = identify(data, options)
    cpu_s = time.process_time() - began_s + (data.estimate_cpu_s if model.uses_estimate else 0.0)
    versions = {name: version(name) for name in packages} | {"python": platform.python_version()}
    told = {"rate_hz": model.rate_hz, "uses_estimate": model.uses_estimate, "cpu_s": cpu_s, "versions": versions}
    arrays = {"A": model.A, "B": model.B, "C": model.C, "D": model.D}
    if model.E is not None:
        arrays["E"] = model.E
    np.savez(sys.argv[2], told=json.dumps(told), **arrays)
