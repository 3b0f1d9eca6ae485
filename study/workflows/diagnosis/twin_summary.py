"""Summary of the mechanical model that `hapteq twin` wrote: its parameters and its prediction error.

Errors are rms errors relative to the rms of the measured channel.
"""

from dataclasses import asdict
from typing import Any

import numpy as np

from analysis.wording import typeset
from equalizer.plant.mechanical_model import Tolerance
from equalizer.signals.signal import FloatArray
from study.workflows.diagnosis.write_twin import WrittenTwin


def summarise_twin(twin: WrittenTwin) -> dict[str, Any]:
    """Summarise parameters, tolerances and errors of the written model as plain values, for a JSON document; units by
    the suffix of a key."""
    model, fit, tolerance = twin.model, twin.fit, twin.model.tolerance
    return {
        "model": str(twin.plan.out),
        "coordinates": model.coordinates,
        "as_one_piece": {
            "up_to_hz": twin.rigid_body.up_to_hz,
            "mass_kg": twin.rigid_body.mass.tolist(),
            "damping_n_s_per_m": twin.rigid_body.damping.tolist(),
            "of_friction_n_s_per_m": twin.rigid_body.friction_damping.tolist(),
        },
        "modes_hz": _compute_modes_hz(twin),
        "tolerance": None if tolerance is None else asdict(tolerance),
        "band_hz": list(fit.band_hz),
        "held_out": fit.held_out,
        "noise": fit.noise,
        "channels": [asdict(channel_error) for channel_error in fit.errors],
        "notes": list(twin.notes),
    }


def format_twin_lines(twin: WrittenTwin) -> tuple[str, ...]:
    """Format the written model as lines of text for the terminal: the rigid body, the modes of further bodies if there
    are any, and the error of each channel (%)."""
    model, fit, tolerance = twin.model, twin.fit, twin.model.tolerance
    rigid_body, mass_tolerance_text = twin.rigid_body, _format_deviation(tolerance, "mass_kg")
    lines = [
        f"As one rigid body, up to {rigid_body.up_to_hz:.3g} Hz: mass {_format_values(rigid_body.mass)} "
        f"kg{mass_tolerance_text}, damping {_format_values(rigid_body.damping)} N s/m, "
        f"{_format_values(rigid_body.friction_damping)} N s/m of it "
        f"from friction and subtracted{_format_deviation(tolerance, 'damping_n_s_per_m')}",
    ]
    if modes_hz := _compute_modes_hz(twin):
        modes_text = ", ".join(f"{frequency_hz:.3g}" for frequency_hz in modes_hz)
        lines.append(f"{model.coordinates} coordinates; modes of the bodies on the driven axes: {modes_text} Hz")
    for channel_error in fit.errors:
        held_out_text = "" if channel_error.held_out is None else f", {channel_error.held_out:.1%} on held-out samples"
        noise_text = "" if channel_error.noise is None else f" (noise {channel_error.noise:.1%})"
        lines.append(
            f"{channel_error.channel}: error {channel_error.fit:.1%}{held_out_text}{noise_text}, {fit.band_hz[0]:g} to "
            f"{fit.band_hz[1]:g} Hz"
        )
    return tuple(lines)


def _compute_modes_hz(twin: WrittenTwin) -> list[float]:
    """Compute the natural frequencies (Hz), ascending, of the bodies coupled to the driven axes, with the driven axes
    fixed: sqrt(k / m) / (2 pi) for each body, which is exact where no two of the bodies are coupled to each other."""
    model, input_count = twin.model, twin.model.inputs
    stiffness_per_mass = np.diag(model.stiffness)[input_count:] / np.diag(model.mass)[input_count:]
    return sorted(float(frequency_hz) for frequency_hz in np.sqrt(np.maximum(stiffness_per_mass, 0.0)) / (2 * np.pi))


def _format_values(values: FloatArray) -> str:
    """Format values with three significant digits, separated by commas."""
    return ", ".join(typeset(f"{value:.3g}") for value in values)


def _format_deviation(tolerance: Tolerance | None, parameter_name: str) -> str:
    """Format the standard deviation of a parameter in brackets, in the unit of the parameter; empty where it is not
    stated. parameter_name: field of `Tolerance`."""
    deviation = None if tolerance is None else getattr(tolerance, parameter_name)
    return "" if deviation is None else f" (± {deviation:.2g})"
