"""Screen that guides through the six-position calibration of the accelerometer, step by step.

The engine reads the sensor and computes the calibration (`study.devices.accelerometer.calibration`); this screen shows
its messages and sends the user's replies.
"""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.widgets import Footer, Input, Label, Static

from study.tui.dismiss_screen import dismiss_screen
from study.tui.engine.from_engine import CalibrationComputed, CalibrationStored, PlacementRequest
from study.tui.engine.to_engine import CalibrateSensor, KeepSensor, LetGo, Reply
from study.tui.home_messages import CommandRequested

HELP = """\
# The accelerometer in six positions

Gravity is the same everywhere: with each axis of the sensor once up and once down, its bias, its sensitivity with
cross-axis, and its noise are known. Take the sensor with its cable off the handle, and have a flat table.

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
"""Key, title and hint of each field."""
BAUD = 2_000_000
"""Default rate of the serial line, bit/s."""
STEPS = 6
"""Number of positions of the calibration."""


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
        self._waits_for: PlacementRequest | None = None
        """Position that the user must confirm; None where none is requested."""
        self._under_way = False
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
            case PlacementRequest(number=number, position=position, previous_reading=readings):
                self._waits_for = message
                if readings is not None:
                    self._note(f"✓ read {', '.join(f'{value:.0f}' for value in readings)}")
                self._show_line(f"{number} of {STEPS}: lay the sensor down with {position}, let go of it, press Enter.")
            case CalibrationComputed(table=table, file=file):
                self._under_way, self._table = False, table
                self.query_one("#seen", Static).update(table)
                self._show_line(f"Enter writes this into {file}; Esc leaves it.")
            case CalibrationStored(file=file):
                self._lock(False)
                self._show_line(f"Written into {file}. `hapteq doctor` checks the sensor. Esc goes back.")

    def reset_after_error(self) -> None:
        """Reset the screen after an error; a panel above the screen shows the error."""
        self._waits_for, self._under_way, self._table = None, False, ""
        self._show_line("F5 begins again.")
        self.query_one("#seen", Static).update("")
        self._lock(False)

    def action_begin(self) -> None:
        """Check port and baud rate, and start the calibration; no effect while it is running."""
        port = self.query_one("#port", Input).value.strip()
        baud = self.query_one("#baud", Input).value.strip() or str(BAUD)
        if self._under_way:
            return
        if not port:
            self._refuse("Name the port.", "port")
        elif not baud.isascii() or not baud.isdigit() or int(baud) < 1:
            self._refuse("The baud rate is a whole number.", "baud")
        else:
            self._under_way, self._table = True, ""
            self.query_one("#seen", Static).update("")
            self._lock(True)
            self._show_line("The port is opened…")
            self.post_message(CommandRequested(CalibrateSensor(port, int(baud))))

    def action_go_on(self) -> None:
        """Enter: confirm the position, else have the result written, else begin from a field."""
        if self._waits_for is not None:
            self._note(f"{self._waits_for.position}: listening, leave it at rest…")
            self.post_message(CommandRequested(Reply(self._waits_for.number, True)))
            self._waits_for = None
        elif self._table:
            self.post_message(CommandRequested(KeepSensor(self._table)))
            self._table = ""
            self._show_line("It is written…")
        elif isinstance(self.focused, Input):
            self.action_begin()

    def action_leave(self) -> None:
        """Close the screen, and stop a running calibration."""
        if self._under_way:
            self.post_message(CommandRequested(LetGo()))
        dismiss_screen(self, None)

    @on(Input.Changed)
    def _clear_message(self) -> None:
        """Replace a message about a field once the field is edited."""
        if not self._under_way:
            self._show_line("F5 begins.")

    def _lock(self, locked: bool) -> None:
        for field in self.query(Input):
            field.disabled = locked

    def _refuse(self, text: str, field: str) -> None:
        self._show_line(text)
        self.query_one(f"#{field}", Input).focus()

    def _show_line(self, text: str) -> None:
        self.query_one("#do", Static).update(text)

    def _note(self, text: str) -> None:
        """Append a line about a position; its reading (✓) replaces the line that was shown during the measurement."""
        results = self.query_one("#seen", Static)
        lines = [line for line in str(results.content).split("\n") if line]
        if text.startswith("✓") and lines:
            lines[-1] = f"{lines[-1].split(':')[0]}: {text}"
        else:
            lines.append(text)
        results.update("\n".join(lines))
