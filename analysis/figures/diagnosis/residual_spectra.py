"""Figure of the residual spectra on held-out data, compared with the spectra of the signal and the noise.

Where the residual of the completed model equals the noise, nothing is left to explain at that frequency.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from analysis.diagnosis.result.residual_spectrum import HeldOutSpectrum
from analysis.diagnosis.unit_wording import typeset_unit
from analysis.figures.diagnosis.stage_style import COMPLETED_STAGE, RETUNED_STAGE
from analysis.figures.picture import Picture
from analysis.figures.style import GREY, create_figure, draw_no_data_note, format_power_of_ten, style_axes

_MAX_COLUMNS = 3
"""Largest number of panels in a row. Chosen by hand."""
_SIGNAL_HANDLE = Line2D([], [], color=GREY, linewidth=0.9, label="measured")
"""Legend entry of the signal."""
_NOISE_HANDLE = Line2D([], [], color=GREY, linewidth=4, alpha=0.4, label="noise")
"""Legend entry of the noise."""


def make_residual_spectra_picture(spectra: Sequence[HeldOutSpectrum]) -> Picture:
    """Make the picture of the residual spectra, with its caption and its text for screen readers."""
    return Picture(
        name="remainder",
        title="Residual on held-out data",
        caption="Amplitude densities in sixths of an octave. Where the solid line lies on the grey band, the "
        "residual is noise; where it lies above, a mismatch remains.",
        figure=draw_residual_spectra(spectra),
        alternative=" ".join(_write_alternative_text(spectrum) for spectrum in spectra),
    )


def draw_residual_spectra(spectra: Sequence[HeldOutSpectrum]) -> Figure:
    """Draw a panel per channel: densities of the signal, of the residuals of the re-tuned and the completed
    model, and of the noise; a note where there are no spectra."""
    if not spectra:
        return draw_no_data_note(create_figure(8.6, 1.6), "There are no held-out data to draw.")
    column_count = min(_MAX_COLUMNS, len(spectra))
    row_count = -(-len(spectra) // column_count)
    figure = create_figure(8.8, 0.9 + (2.1 if column_count > 1 else 2.6) * row_count)
    grid = figure.subplots(row_count, column_count, sharex=True, squeeze=False)
    for axes in grid.ravel()[len(spectra) :]:
        axes.set_visible(False)
    for axes, spectrum in zip(grid.ravel(), spectra, strict=False):
        _draw_panel(axes, spectrum)
    figure.supxlabel("Frequency (Hz)", fontsize=9.5)
    handles = [_SIGNAL_HANDLE, RETUNED_STAGE.handle, COMPLETED_STAGE.handle, _NOISE_HANDLE]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=9, frameon=False)
    return figure


def _draw_panel(axes: Axes, spectrum: HeldOutSpectrum) -> None:
    """Draw the densities of one channel on logarithmic axes."""
    style_axes(axes)
    axes.loglog(spectrum.frequency_hz, spectrum.measured, color=GREY, linewidth=0.9)
    if np.isfinite(spectrum.noise).any():
        axes.loglog(spectrum.frequency_hz, spectrum.noise, color=GREY, linewidth=4, alpha=0.4)
    for stage, values in ((RETUNED_STAGE, spectrum.retuned), (COMPLETED_STAGE, spectrum.after)):
        axes.loglog(spectrum.frequency_hz, values, color=stage.colour, linestyle=stage.dash, linewidth=stage.width)
    axes.set_title(f"{spectrum.channel} ({typeset_unit(spectrum.unit)}/√Hz)", fontsize=9, loc="left", pad=3)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_locator(LogLocator(numticks=5))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: format_power_of_ten(value)))
    # Minor ticks would double the time to draw the figure.
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_locator(NullLocator())
    axes.tick_params(labelsize=8)


def _write_alternative_text(spectrum: HeldOutSpectrum) -> str:
    """Write the largest ratio of the completed model's residual to the noise, if it is known, and its frequency."""
    ratio = spectrum.after / spectrum.noise
    if not np.isfinite(ratio).any():
        return f"{spectrum.channel}: the noise is not known."
    peak = int(np.nanargmax(ratio))
    return f"{spectrum.channel}: at most {ratio[peak]:.2g} times the noise, at {spectrum.frequency_hz[peak]:.3g} Hz."
