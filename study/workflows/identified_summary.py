"""What is said of an identified device: lines for a person, a document for a program."""

from typing import Any

from study.workflows.identify_model import IdentifiedDevice

POOR = 0.05
"""Error of a prediction from which a user is told what may be behind it."""


def summary(device: IdentifiedDevice) -> dict[str, Any]:
    """The figures, for a person's lines and a program's JSON alike."""
    model, tested = device.model, device.tested
    low, high = model.band_hz
    return {
        "model": str(device.plan.out),
        "order": model.order,
        "band_hz": [low, high],
        "spectral_radius": model.spectral_radius,
        "lines": device.identified.lines,
        "rms_relative_error": device.identified.rms_relative_error,
        "worst_relative_error": device.identified.worst_relative_error,
        "held_out_error": tested.error if tested else None,
        "held_out_noise": tested.noise if tested else None,
        "held_out_s": tested.seconds if tested else None,
        "freed_of": model.provenance["freed_of"],
        "remarks": list(device.remarks),
    }


def summary_lines(device: IdentifiedDevice) -> tuple[str, ...]:
    found = summary(device)
    low, high = found["band_hz"]
    lines = [
        f"Order {found['order']}, {low:g} to {high:g} Hz, stable (slowest pole {found['spectral_radius']:.5f}), "
        f"from {found['lines']} lines.",
        f"Model against estimate: {100 * found['rms_relative_error']:.2f} % rms, worst line "
        f"{100 * found['worst_relative_error']:.2f} %; the estimate's own noise is in both.",
    ]
    if found["freed_of"]:
        lines.append(f"The recordings were freed of {', '.join(found['freed_of'])}; play with --physics.")
    if device.tested is None:
        lines.append("No recording was kept for a test (role 'test'): how well the model predicts is not known.")
    else:
        noise = f", of which noise {100 * device.tested.noise:.2f} %" if device.tested.noise is not None else ""
        lines.append(
            f"Predicts the {device.tested.seconds:g} s kept for a test with an error of "
            f"{100 * device.tested.error:.2f} % in the band{noise}."
        )
        if device.tested.error > max(POOR, 3 * (device.tested.noise or 0.0)):
            lines.append(
                "That is what a linear model of this order cannot say of this device: mostly friction, where there is "
                "some. Clipped sensors and a moving grip look the same. Stronger sweeps suffer less from friction."
            )
    return tuple(lines)
