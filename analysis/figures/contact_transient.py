"""Figure of an acceleration transient that is played at a contact, along the surface normal.

Three rows over time, a column per way of playing it: acceleration along the normal, target and measured; magnitude of
the measured acceleration across the normal, which should be 0; and the forces.
"""

import numpy as np
from matplotlib.figure import Figure

from analysis.figures.picture import Picture
from analysis.figures.style import BLUE, GREEN, GREY, VERMILLION, create_figure, style_axes
from equalizer.signals.signal import FloatArray

PlayedTransient = tuple[str, FloatArray, FloatArray]
"""Transient as played in one way: name of the way, forces (n, 3) in N, and measured acceleration (n, 3) in m/s²."""


def make_contact_picture(
    normal: FloatArray, sample_rate_hz: float, target_mps2: FloatArray, *played_transients: PlayedTransient
) -> Picture:
    """Make the picture of a transient played at a contact. normal: (3,), unit vector of the surface. target_mps2: (n,
    3), target acceleration. played_transients: at least one."""
    normal_text = ", ".join(f"{component:.2g}" for component in normal)
    return Picture(
        name="contact",
        title=f"A transient along the normal ({normal_text})",
        caption="Columns: ways to play it. Above: acceleration along the normal, target (grey) and measured. Middle: "
        "magnitude of the measured acceleration across the normal, whose target is 0. Below: the forces.",
        figure=_draw_transient(normal, sample_rate_hz, target_mps2, played_transients),
        alternative="Acceleration along and across the normal, and forces, over time, for "
        + " and ".join(name for name, _, _ in played_transients),
    )


def _draw_transient(
    normal: FloatArray, sample_rate_hz: float, target_mps2: FloatArray, played_transients: tuple[PlayedTransient, ...]
) -> Figure:
    """Draw a column per way of playing the transient: accelerations along and across the normal, and forces."""
    figure = create_figure(4.3 * len(played_transients), 5.6)
    grid = figure.subplots(3, len(played_transients), sharex=True, sharey="row", squeeze=False)
    time_ms = 1000 * np.arange(len(target_mps2)) / sample_rate_hz
    for column_axes, (name, forces_n, measured_mps2) in zip(grid.T, played_transients, strict=True):
        along_normal = measured_mps2 @ normal
        across_normal = np.linalg.norm(measured_mps2 - np.outer(along_normal, normal), axis=1)
        column_axes[0].plot(time_ms, target_mps2 @ normal, color=GREY, linewidth=2.2, label="target")
        column_axes[0].plot(time_ms, along_normal, color=BLUE, linewidth=1.0, label="measured")
        column_axes[1].plot(time_ms, across_normal, color=VERMILLION, linewidth=1.0)
        for component, axis, colour in zip(forces_n.T, "xyz", (BLUE, VERMILLION, GREEN), strict=True):
            column_axes[2].plot(time_ms, component, color=colour, linewidth=1.0, label=f"f{axis}")
        column_axes[0].set_title(name, fontsize=10)
        column_axes[2].set_xlabel("Time after the contact (ms)")
        for axes in column_axes:
            style_axes(axes)
    for axes, label in zip(grid[:, 0], ("Along (m/s²)", "Across (m/s²)", "Force (N)"), strict=True):
        axes.set_ylabel(label, fontsize=9)
    for axes in (grid[0, 0], grid[2, 0]):
        axes.legend(fontsize=8, frameon=False)
    return figure
