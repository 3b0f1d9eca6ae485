"""Sources of accelerometer samples by the name of the port: a board on a serial line, or a data-acquisition device.

`ni:Dev1` reads ai0 to ai2 of a National Instruments device, `labjack:ANY` AIN0 to AIN2 of a LabJack T-series device (a
serial number or name in place of ANY selects a device), in volts. The time of a sample is its number divided by the
sample rate. **Tested with fakes of the vendors' packages only**, never with a driver or a device. Called by
`study.devices.force_dimension.lab` and by `six_positions`.
"""

import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.samples import PacketCounts, Samples, SampleSource
from study.devices.accelerometer.serial_reader import open_serial
from study.errors import DeviceError

NI_PREFIX, LABJACK_PREFIX = "ni:", "labjack:"
"""Prefixes of a port that names a data-acquisition device instead of a serial line."""

SCAN_HZ = 4000.0
"""Requested sample rate of each channel (Hz): about twice the least accepted rate (`sensor_findings.MIN_RATE_HZ`).
Chosen."""
READ_INTERVAL_S = 0.01
"""Interval between two reads (s); the scans of an interval are read together. Chosen: short against the age at which a
sample counts as missing (`newest_sample.MAX_AGE_S`)."""

LOST_SCAN_V = -9999.0
"""Value (V) that the LabJack driver writes in place of a lost scan (LJM_DUMMY_VALUE of the LJM library)."""


def open_source(port: str, baud: int) -> SampleSource:
    """Open the source of samples at a port, by its name. baud: bits per second, of a serial line only. Raises
    `DeviceError` where it cannot be opened."""
    if port.startswith(NI_PREFIX):
        return _open_acquisition_device(
            lambda: NiSource(port.removeprefix(NI_PREFIX)), port, "nidaqmx", "ni", "NI-DAQmx from ni.com"
        )
    if port.startswith(LABJACK_PREFIX):
        identifier = port.removeprefix(LABJACK_PREFIX)
        return _open_acquisition_device(
            lambda: LabJackSource(identifier), port, "labjack-ljm", "labjack", "the LJM library from labjack.com"
        )
    return open_serial(port, baud)


def has_volt_samples(port: str) -> bool:
    """Whether the raw values of this port are volts; else they are counts of 16 bits."""
    return port.startswith((NI_PREFIX, LABJACK_PREFIX))


class ScanCounter:
    """Numbers and times of the scans of a device that supplies neither. `counts`: scans received and lost so far."""

    def __init__(self, rate_hz: float) -> None:
        """rate_hz: sample rate that the device reports, from which the times are computed."""
        self._rate_hz, self._next_number = rate_hz, 0
        self.counts = PacketCounts()

    def convert_scans(self, volts: FloatArray) -> Samples:
        """Convert scans to samples with number and time. volts: (n, 3), in order; a row with `LOST_SCAN_V` is a lost
        scan and gives no sample."""
        numbers = self._next_number + np.arange(len(volts))
        self._next_number += len(volts)
        is_received = (volts != LOST_SCAN_V).all(axis=1)
        previous_counts, received_count = self.counts, int(is_received.sum())
        self.counts = PacketCounts(
            previous_counts.packets + received_count, previous_counts.lost + len(volts) - received_count
        )
        numbers = numbers[is_received]
        time_us = np.round(1e6 * numbers / self._rate_hz).astype(np.int64)
        return Samples(numbers, time_us, volts[is_received], np.zeros(received_count, dtype=np.int64))


class NiSource:
    """Source that reads a data-acquisition device of National Instruments. All methods pass exceptions of nidaqmx
    on; the constructor raises ImportError without the package."""

    def __init__(self, device: str) -> None:
        """device: name in the driver, such as Dev1."""
        nidaqmx, constants = import_module("nidaqmx"), import_module("nidaqmx.constants")
        self._read_all = constants.READ_ALL_AVAILABLE
        self._task: Any = nidaqmx.Task()
        try:
            self._task.ai_channels.add_ai_voltage_chan(f"{device}/ai0:2")
            self._task.timing.cfg_samp_clk_timing(SCAN_HZ, sample_mode=constants.AcquisitionType.CONTINUOUS)
            self._scans = ScanCounter(float(self._task.timing.samp_clk_rate))
            self._task.start()
        except BaseException:
            self._task.close()
            raise

    @property
    def counts(self) -> PacketCounts:
        """Scans received and lost since the device was opened."""
        return self._scans.counts

    def read(self) -> tuple[Samples, float]:
        """Wait for `READ_INTERVAL_S`, then return the scans since the last call and the time after reading (s,
        `time.monotonic`)."""
        time.sleep(READ_INTERVAL_S)
        volts_by_channel = self._task.read(number_of_samples_per_channel=self._read_all)
        arrived_s = time.monotonic()
        return self._scans.convert_scans(np.array(volts_by_channel, dtype=np.float64).reshape(3, -1).T), arrived_s

    def close(self) -> None:
        """End the task of the device."""
        self._task.close()


class LabJackSource:
    """Source that reads a LabJack. All methods pass exceptions of labjack-ljm on; the constructor raises ImportError
    without the package."""

    def __init__(self, identifier: str) -> None:
        """identifier: serial number or name; empty or ANY = any device."""
        self._ljm: Any = import_module("labjack.ljm")
        self._handle = self._ljm.openS("ANY", "ANY", identifier or "ANY")
        try:
            addresses = self._ljm.namesToAddresses(3, ["AIN0", "AIN1", "AIN2"])[0]
            rate_hz = self._ljm.eStreamStart(self._handle, round(SCAN_HZ * READ_INTERVAL_S), 3, addresses, SCAN_HZ)
            self._scans = ScanCounter(float(rate_hz))
        except BaseException:
            self._ljm.close(self._handle)
            raise

    @property
    def counts(self) -> PacketCounts:
        """Scans received and lost since the device was opened."""
        return self._scans.counts

    def read(self) -> tuple[Samples, float]:
        """Return the next scans, as many as arrive in `READ_INTERVAL_S`, and the time after reading (s,
        `time.monotonic`)."""
        volts = self._ljm.eStreamRead(self._handle)[0]  # returns when the next scans are complete
        arrived_s = time.monotonic()
        return self._scans.convert_scans(np.array(volts, dtype=np.float64).reshape(-1, 3)), arrived_s

    def close(self) -> None:
        """End the stream and close the device."""
        try:
            self._ljm.eStreamStop(self._handle)
        finally:
            self._ljm.close(self._handle)


def _open_acquisition_device(
    open_device: Callable[[], SampleSource], port: str, package: str, extra: str, driver: str
) -> SampleSource:
    """Open a data-acquisition device. Raises `DeviceError`, with a remedy, where package, driver or device is missing.
    extra: extra of hapteq that installs the package; driver: vendor's driver, with its origin, for the message."""
    try:
        return open_device()
    except ImportError as error:
        raise DeviceError(
            "The accelerometer cannot be read",
            f"The package {package} is not installed.",
            f"Install hapteq with that extra: pip install '.[{extra}]'.",
        ) from error
    except Exception as error:
        raise DeviceError(
            "The accelerometer cannot be opened",
            f"{port}: {type(error).__name__}: {error}.",
            f"Install {driver}, plug the device in, and name it as its maker's program does.",
        ) from error
