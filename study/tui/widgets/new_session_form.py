"""Form of the start screen that begins a session: participant, protocol, device, and a model where one is needed.

Problems are shown while typing. They are found from the list of sessions on the screen; the program that begins a
session checks again.
"""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Button, Input, Label, Select, Static

from study.session.views.archive_views import HomeView, SessionLine
from study.session.views.participant_codes import code_problem, is_code, suggest_code
from study.tui.home_messages import BeginWanted

SIMULATED = "simulated"
"""Name of the simulated device; the list of devices adds that nothing moves."""
PLACEHOLDER = [("…", "")]
"""Entry of a list whose choices are not known yet; the list is disabled."""


class NewSessionForm(Vertical):
    """Fields of a new session. F5 or the button posts `BeginWanted` if all fields are valid; otherwise a line below
    names the problem, and the field of the code or of the protocol gets the focus."""

    DEFAULT_CSS = """
    NewSessionForm { height: auto; border: round $primary; padding: 0 1; }
    NewSessionForm:focus-within { border: round $accent; }
    NewSessionForm .field { height: auto; }
    NewSessionForm #equalizer { display: none; }
    NewSessionForm.-equalized #equalizer { display: block; }
    NewSessionForm Label { width: 13; }
    NewSessionForm Input, NewSessionForm Select { width: 1fr; }
    NewSessionForm #about { height: 2; color: $foreground 65%; }
    NewSessionForm #about.-problem { color: $text-error; }
    NewSessionForm #about.-notice { color: $text-warning; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("f5", "begin", "Begin")]

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.border_title = "New session"
        self._home: HomeView | None = None

    def compose(self) -> ComposeResult:
        with Horizontal(classes="field"):
            yield Label("Participant")
            yield Input(placeholder="code, such as P01", compact=True, id="code", max_length=64)
        with Horizontal(classes="field"):
            yield Label("Protocol")
            yield Select[str](PLACEHOLDER, allow_blank=False, compact=True, id="protocol", disabled=True)
        with Horizontal(classes="field"):
            yield Label("Device")
            yield Select[str](PLACEHOLDER, allow_blank=False, compact=True, id="device", disabled=True)
        with Horizontal(classes="field", id="equalizer"):
            yield Label("Model")
            yield Select[str](PLACEHOLDER, allow_blank=False, compact=True, id="model", disabled=True)
        yield Static("", id="about", markup=False)
        yield Button("Begin (F5)", variant="primary", compact=True, id="begin", disabled=True)

    def show(self, home: HomeView) -> None:
        """Show the choices of `home`; earlier selections are kept where they are still available."""
        self._home = home
        self._set_options("#protocol", [(_protocol_prompt(p.name, p.locked), p.name) for p in home.protocols])
        self._set_options("#device", [(_device_prompt(name), name) for name in home.devices])
        self._set_options("#model", [(_model_prompt(path, home), path) for path in home.models])
        proposed = suggest_code(tuple(line.subject for line in home.sessions if line.observer is None))
        self.query_one("#code", Input).placeholder = f"code, such as {proposed}"
        self.query_one("#begin", Button).disabled = not (home.protocols and home.devices)
        self._show_problem()

    def action_begin(self) -> None:
        self._submit()

    @on(Input.Submitted, "#code")
    @on(Button.Pressed, "#begin")
    def _submit(self) -> None:
        if self._home is None or self.query_one("#begin", Button).disabled:
            return
        code = self._code
        problem = code_problem(code) or self._find_standing_problem(code)
        if problem or self._model_problem:
            self._show_about(problem or self._model_problem, "-problem")
            self.query_one("#code" if problem else "#protocol").focus()
            return
        model = self._read_selected("#model") if self._equalized else ""
        self.post_message(BeginWanted(code, self._read_selected("#protocol"), self._read_selected("#device"), model))

    @on(Input.Changed, "#code")
    @on(Select.Changed)
    def _show_problem(self) -> None:
        if self._home is None:
            return
        code = self._code
        self.set_class(self._equalized, "-equalized")
        if code and not is_code(code):
            self._show_about(code_problem(code), "-problem")
        elif problem := self._find_standing_problem(code):
            self._show_about(problem, "-problem")
        elif self._model_problem:
            self._show_about(self._model_problem, "-problem")
        elif notice := self._notice(code):
            self._show_about(notice, "-notice")
        else:
            protocol = self._read_selected("#protocol")
            self._show_about(next((p.title for p in self._home.protocols if p.name == protocol), ""), "")

    @property
    def _equalized(self) -> bool:
        chosen = self._read_selected("#protocol")
        return self._home is not None and any(p.equalized for p in self._home.protocols if p.name == chosen)

    @property
    def _model_problem(self) -> str:
        if not self._equalized or self._read_selected("#model"):
            return ""
        return "This protocol needs a model, next to the data: hapteq record, hapteq identify."

    @property
    def _code(self) -> str:
        return self.query_one("#code", Input).value.strip()

    def _find_standing_problem(self, code: str) -> str:
        """Problem of a code that the list of sessions shows: its participant withdrew. Empty if there is none."""
        return next((f"{code} withdrew: this code is not given again." for line in self._sessions(code)
                     if line.standing == "withdrawn"), "")  # fmt: skip

    def _notice(self, code: str) -> str:
        """Remark on a valid code that is in use: an unfinished session of this protocol, or other sessions."""
        lines, protocol = self._sessions(code), self._read_selected("#protocol")
        for line in lines:
            if line.standing == "unfinished" and line.protocol == _name(protocol, self._home):
                return (
                    f"{line.name} of this protocol is not finished. Beginning makes another one; r in the list resumes."
                )
        if lines:
            count = "a session" if len(lines) == 1 else f"{len(lines)} sessions"
            return f"{code} has {count} here already. Is it the same person?"
        return ""

    def _sessions(self, code: str) -> list[SessionLine]:
        return [line for line in self._home.sessions if line.subject == code] if self._home and code else []

    def _read_selected(self, selector: str) -> str:
        value = self.query_one(selector, Select).value
        return value if isinstance(value, str) else ""

    def _set_options(self, selector: str, options: list[tuple[str, str]]) -> None:
        select: Select[str] = self.query_one(selector, Select)
        previous_value = select.value
        values = [value for _, value in options or PLACEHOLDER]
        select.set_options(options or PLACEHOLDER)
        select.disabled = not options
        select.value = previous_value if previous_value in values else values[0]

    def _show_about(self, text: str, kind: str) -> None:
        about_line = self.query_one("#about", Static)
        about_line.set_class(kind == "-problem", "-problem")
        about_line.set_class(kind == "-notice", "-notice")
        about_line.update(f"! {text}" if kind else text)


def _protocol_prompt(name: str, locked: bool) -> str:
    return f"{name} (locked)" if locked else name


def _device_prompt(name: str) -> str:
    return f"{name} (nothing moves)" if name == SIMULATED else name


def _model_prompt(path: str, home: HomeView) -> str:
    quality = home.quality_of(path)
    return f"{_file_name(path)} ({quality})" if quality else _file_name(path)


def _file_name(path: str) -> str:
    return path.replace("\\", "/").rpartition("/")[2]


def _name(protocol: str, home: HomeView | None) -> str:
    """Name of a protocol that is given by name or path. Assumes that a file is named after its protocol; for other
    files the notice about an unfinished session is not shown."""
    return protocol.replace("\\", "/").rpartition("/")[2].removesuffix(".toml")
