"""Screen that guides through the six-position calibration of the accelerometer, step by step.

The engine reads the sensor and computes the calibration (`study.devices.accelerometer.calibration`); this screen shows
its messages and sends the user's replies.
"""

import re
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.widgets import Footer, Input, Label, Static

from study.tui.dismiss_screen import dismiss_screen
from study.tui.engine.from_engine import CalibrationComputed, CalibrationStored, PlacementRequest
from study.tui.engine.to_engine import CalibrateSensor, Interrupt, Reply, StoreCalibration
from study.tui.home_messages import CommandRequested

HELP = """\
# The accelerometer in six positions

Gravity is a known acceleration: with each axis of the sensor once up and once down, its bias, its sensitivity
(cross-axis terms included) and its noise can be computed. Take the sensor with its cable off the handle, and have a
flat table.

1. Name the **port** of the board: /dev/ttyACM0 or so, on Windows COM3. No other program may read it.
2. **F5** begins. Lay the sensor down as it says, let go of it, press **Enter**, and wait for 2 seconds: it must not
   move.
3. After the sixth position the table of the lab's file is shown. **Enter** writes it there; the file that was there
   before is kept next to it.

A position that does not fit the others is named at the end: begin again with F5. **Esc** stops.

In a terminal: `hapteq doctor --calibrate-sensor PORT --keep`.
"""
"""Help of the screen, in Markdown."""
FIELDS = (("port", "Port", "/dev/ttyACM0"), ("baud", "Baud", "2000000"))
"""Name, label and placeholder of each field, from top to bottom."""
DEFAULT_BAUD_RATE = 2_000_000
"""Rate of the serial line (bit/s) where the field is empty. Equal to the default of `baud` in
`study.devices.force_dimension.lab`; the screens import no device modules."""
BAUD_RATE_PATTERN = r"[1-9][0-9]{0,8}"
"""Pattern of a baud rate: serial lines are slower than 1e9 bit/s, and the system refuses numbers from 2^31 on."""
POSITION_COUNT = 6
"""Number of positions of the calibration: each of three axes up and down."""


class SensorScreen(Screen[None]):
    """Guides through the six positions of the calibration. F5 begins; Enter confirms that the sensor lies as requested
    and, at the end, has the result written into the lab's file; Esc stops or goes back."""

    HELP = HELP
    CSS = """
    SensorScreen { align: center middle; }
    SensorScreen > Vertical {
        width: 76; max-width: 95%; height: auto; border: round $primary; padding: 1 2; background: $surface;
    }
    SensorScreen .field { height: auto; }
    SensorScreen Label { width: 8; }
    SensorScreen Input { width: 1fr; }
    SensorScreen #do { margin-top: 1; text-style: bold; }
    SensorScreen #seen { height: auto; color: $foreground 80%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f5", "begin", "Begin", priority=True),
        Binding("enter", "go_on", "Go on", priority=True),
        Binding("escape", "leave", "Back", key_display="Esc"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._pending_placement: PlacementRequest | None = None
        """Position that the user must confirm; None where none is requested."""
        self._is_calibrating = False
        """Whether a calibration is running."""
        self._table = ""
        """Result (TOML) that Enter writes into the lab's file; empty where there is none."""

    def compose(self) -> ComposeResult:
        with Vertical() as box:
            box.border_title = "The accelerometer in six positions"
            for name, title, hint in FIELDS:
                with Horizontal(classes="field"):
                    yield Label(title)
                    yield Input(placeholder=hint, compact=True, id=name)
            yield Static("F5 begins.", id="do", markup=False)
            yield Static("", id="seen", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.query_one("#port", Input).focus()

    def handle_message(self, message: PlacementRequest | CalibrationComputed | CalibrationStored) -> None:
        """Handle a message of the engine: show the next position, the result, or that the result was written."""
        match message:
            case PlacementRequest(number=number, position=position, previous_reading=reading):
                self._pending_placement = message
                if reading is not None:
                    self._append_reading_line(f"✓ read {', '.join(f'{value:.0f}' for value in reading)}")
                self._show_instruction(
                    f"{number} of {POSITION_COUNT}: lay the sensor down with {position}, let go of it, press Enter."
                )
            case CalibrationComputed(table=table, file=file):
                self._is_calibrating, self._table = False, table
                self.query_one("#seen", Static).update(table)
                self._show_instruction(f"Enter writes this into {file}; Esc leaves it.")
            case CalibrationStored(file=file):
                self._set_fields_disabled(False)
                self._show_instruction(f"Written into {file}. `hapteq doctor` checks the sensor. Esc goes back.")

    def reset_after_error(self) -> None:
        """Reset the screen after an error; a panel above the screen shows the error."""
        self._pending_placement, self._is_calibrating, self._table = None, False, ""
        self._show_instruction("F5 begins again.")
        self.query_one("#seen", Static).update("")
        self._set_fields_disabled(False)

    def action_begin(self) -> None:
        """Check port and baud rate, and start the calibration; no effect while it is running."""
        port = self.query_one("#port", Input).value.strip()
        baud = self.query_one("#baud", Input).value.strip() or str(DEFAULT_BAUD_RATE)
        if self._is_calibrating:
            return
        if not port:
            self._show_field_problem("Name the port.", "port")
        elif re.fullmatch(BAUD_RATE_PATTERN, baud) is None:
            self._show_field_problem("The baud rate is a whole number. It has at most 9 digits.", "baud")
        else:
            self._is_calibrating, self._table = True, ""
            self.query_one("#seen", Static).update("")
            self._set_fields_disabled(True)
            self._show_instruction("The port is opened…")
            self.post_message(CommandRequested(CalibrateSensor(port, int(baud))))

    def action_go_on(self) -> None:
        """Confirm the position that is requested; else request that the result be written; else begin, where a field
        has the focus."""
        if self._pending_placement is not None:
            self._append_reading_line(f"{self._pending_placement.position}: listening, leave it at rest…")
            self.post_message(CommandRequested(Reply(self._pending_placement.number, True)))
            self._pending_placement = None
        elif self._table:
            self.post_message(CommandRequested(StoreCalibration(self._table)))
            self._table = ""
            self._show_instruction("It is written…")
        elif isinstance(self.focused, Input):
            self.action_begin()

    def action_leave(self) -> None:
        """Close the screen, and stop a running calibration."""
        if self._is_calibrating:
            self.post_message(CommandRequested(Interrupt()))
        dismiss_screen(self, None)

    @on(Input.Changed)
    def _clear_message(self) -> None:
        """Replace a message about a field once the field is edited."""
        if not self._is_calibrating:
            self._show_instruction("F5 begins.")

    def _set_fields_disabled(self, disabled: bool) -> None:
        """Disable or enable the fields; they are disabled during a calibration."""
        for field in self.query(Input):
            field.disabled = disabled

    def _show_field_problem(self, text: str, field: str) -> None:
        """Show a problem, and focus the field that it concerns."""
        self._show_instruction(text)
        self.query_one(f"#{field}", Input).focus()

    def _show_instruction(self, text: str) -> None:
        """Show the next step in the line below the fields, in place of the previous one."""
        self.query_one("#do", Static).update(text)

    def _append_reading_line(self, text: str) -> None:
        """Append a line about a position to the list of results; a reading (✓) completes the last line instead: it
        replaces the text after the name of the position."""
        results = self.query_one("#seen", Static)
        lines = [line for line in str(results.content).split("\n") if line]
        if text.startswith("✓") and lines:
            lines[-1] = f"{lines[-1].split(':')[0]}: {text}"
        else:
            lines.append(text)
        results.update("\n".join(lines))
