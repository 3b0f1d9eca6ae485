"""Summary of `hapteq twin`, which writes the nominal mechanical model of a device: its parameters and prediction error.

The same figures as lines for the terminal and as plain values for JSON. Errors are relative (rms over that of the
channel).
"""

from dataclasses import asdict
from typing import Any

import numpy as np

from analysis.wording import typeset
from equalizer.plant.mechanical_model import Tolerance
from equalizer.signals.signal import FloatArray
from study.workflows.diagnosis.write_twin import WrittenTwin


def twin_summary(twin: WrittenTwin) -> dict[str, Any]:
    """The written model as plain values, for one JSON document."""
    model, fit, tolerance = twin.model, twin.fit, twin.model.tolerance
    return {
        "model": str(twin.plan.out),
        "coordinates": model.coordinates,
        "as_one_piece": {
            "up_to_hz": twin.rigid_body.up_to_hz,
            "mass_kg": twin.rigid_body.mass.tolist(),
            "damping_n_s_per_m": twin.rigid_body.damping.tolist(),
            "of_friction_n_s_per_m": twin.rigid_body.of_friction.tolist(),
        },
        "modes_hz": _modes_hz(twin),
        "tolerance": None if tolerance is None else asdict(tolerance),
        "band_hz": list(fit.band_hz),
        "held_out": fit.held_out,
        "noise": fit.noise,
        "channels": [asdict(error) for error in fit.errors],
        "notes": list(twin.notes),
    }


def twin_lines(twin: WrittenTwin) -> tuple[str, ...]:
    """Lines for the terminal: the rigid body, its modes, and the error of each channel."""
    model, fit, tolerance = twin.model, twin.fit, twin.model.tolerance
    rigid_body, mass_open = twin.rigid_body, _range(tolerance, "mass_kg")
    lines = [
        f"As one rigid body, up to {rigid_body.up_to_hz:.3g} Hz: mass {_values(rigid_body.mass)} kg{mass_open}, "
        f"damping {_values(rigid_body.damping)} N s/m, {_values(rigid_body.of_friction)} N s/m of it from friction and "
        f"subtracted{_range(tolerance, 'damping_n_s_per_m')}",
    ]
    if modes := _modes_hz(twin):
        swing = ", ".join(f"{frequency_hz:.3g}" for frequency_hz in modes)
        lines.append(f"{model.coordinates} coordinates; modes of the bodies on the driven axes: {swing} Hz")
    for error in fit.errors:
        held_out_text = "" if error.held_out is None else f", {error.held_out:.1%} on held-out samples"
        noise = "" if error.noise is None else f" (noise {error.noise:.1%})"
        lines.append(
            f"{error.channel}: error {error.fit:.1%}{held_out_text}{noise}, {fit.band_hz[0]:g} to {fit.band_hz[1]:g} Hz"
        )
    return tuple(lines)


def _modes_hz(twin: WrittenTwin) -> list[float]:
    """Natural frequencies (Hz), ascending, of the bodies behind the driven axes with these held still:
    sqrt(k / m) / 2 pi of each, exact where no two bodies are joined to each other."""
    model, m = twin.model, twin.model.inputs
    ratio = np.diag(model.stiffness)[m:] / np.diag(model.mass)[m:]
    return sorted(float(frequency) for frequency in np.sqrt(np.maximum(ratio, 0.0)) / (2 * np.pi))


def _values(values: FloatArray) -> str:
    """Three digits each, separated by commas."""
    return ", ".join(typeset(f"{value:.3g}") for value in values)


def _range(tolerance: Tolerance | None, name: str) -> str:
    """The standard deviation of a parameter in brackets; empty where it is not known."""
    value = None if tolerance is None else getattr(tolerance, name)
    return "" if value is None else f" (± {value:.2g})"
