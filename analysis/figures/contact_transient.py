"""Figure of an acceleration transient that is played at a contact, along the surface normal.

Three rows over time, a column per way of playing it: acceleration along the normal, target and measured; magnitude of
the measured acceleration across the normal, which should be 0; and the forces. Called by
`study.workflows.equalizer.play_contact`.
"""

import numpy as np
from matplotlib.figure import Figure

from analysis.figures.picture import Picture
from analysis.figures.style import BLUE, GREEN, GREY, VERMILLION, create_figure, style_axes
from equalizer.signals.signal import FloatArray

Play = tuple[str, FloatArray, FloatArray]
"""One way of playing the transient: its name, forces (n, 3) in N, and measured acceleration (n, 3) in m/s^2."""


def make_contact_picture(normal: FloatArray, sample_rate_hz: float, target: FloatArray, *plays: Play) -> Picture:
    """Make the picture of a transient played at a contact. normal: (3,), unit vector of the surface. target: (n, 3),
    target acceleration in m/s^2. plays: at least one."""
    normal_text = ", ".join(f"{component:.2g}" for component in normal)
    return Picture(
        name="contact",
        title=f"A transient along the normal ({normal_text})",
        caption="Columns: ways to play it. Above: acceleration along the normal, wanted (grey) and measured. Middle: "
        "length of what was measured across the normal, which nothing wants. Below: the forces.",
        figure=_draw_transient(normal, sample_rate_hz, target, plays),
        alternative="Acceleration along and across the normal, and forces, over time, for "
        + " and ".join(name for name, _, _ in plays),
    )


def _draw_transient(normal: FloatArray, rate_hz: float, target_mps2: FloatArray, plays: tuple[Play, ...]) -> Figure:
    """Draw a column per way of playing the transient: accelerations along and across the normal, and forces."""
    figure = create_figure(4.3 * len(plays), 5.6)
    grid = figure.subplots(3, len(plays), sharex=True, sharey="row", squeeze=False)
    time_ms = 1000 * np.arange(len(target_mps2)) / rate_hz
    for column, (name, forces_n, measured_mps2) in zip(grid.T, plays, strict=True):
        along_normal = measured_mps2 @ normal
        across_normal = np.linalg.norm(measured_mps2 - np.outer(along_normal, normal), axis=1)
        column[0].plot(time_ms, target_mps2 @ normal, color=GREY, linewidth=2.2, label="wanted")
        column[0].plot(time_ms, along_normal, color=BLUE, linewidth=1.0, label="measured")
        column[1].plot(time_ms, across_normal, color=VERMILLION, linewidth=1.0)
        for component, axis, colour in zip(forces_n.T, "xyz", (BLUE, VERMILLION, GREEN), strict=True):
            column[2].plot(time_ms, component, color=colour, linewidth=1.0, label=f"f{axis}")
        column[0].set_title(name, fontsize=10)
        column[2].set_xlabel("Time after the contact (ms)")
        for axes in column:
            style_axes(axes)
    for axes, label in zip(grid[:, 0], ("Along (m/s²)", "Across (m/s²)", "Force (N)"), strict=True):
        axes.set_ylabel(label, fontsize=9)
    for axes in (grid[0, 0], grid[2, 0]):
        axes.legend(fontsize=8, frameon=False)
    return figure
