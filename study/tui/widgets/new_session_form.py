"""Form of the start screen (`study.tui.screens.home`) for a new session: participant, protocol, device, and a model
where the protocol needs one.

Problems are shown while typing, from the list of sessions on the screen.
"""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.widgets import Button, Input, Label, Select, Static

from study.session.views.archive_views import HomeView, SessionLine
from study.session.views.participant_codes import explain_invalid_code, is_code, suggest_code
from study.session.views.printable import replace_unprintable
from study.session.views.resume_command import SIMULATED_DEVICE
from study.tui.home_messages import BeginRequested

PLACEHOLDER_OPTIONS = [("…", "")]
"""Entry of a list whose choices are not known yet, or that has none; the list is disabled."""


class NewSessionForm(Vertical):
    """Fields of a new session. F5, the button, or Enter in the field of the code posts `BeginRequested` if all fields
    are valid; otherwise a line below states the problem, and the field of the code or of the protocol gets the
    focus."""

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
            # 64 characters are more than a valid code has: a code that is too long stays visible and is explained.
            yield Input(placeholder="code, such as P01", compact=True, id="code", max_length=64)
        with Horizontal(classes="field"):
            yield Label("Protocol")
            yield Select[str](PLACEHOLDER_OPTIONS, allow_blank=False, compact=True, id="protocol", disabled=True)
        with Horizontal(classes="field"):
            yield Label("Device")
            yield Select[str](PLACEHOLDER_OPTIONS, allow_blank=False, compact=True, id="device", disabled=True)
        with Horizontal(classes="field", id="equalizer"):
            yield Label("Model")
            yield Select[str](PLACEHOLDER_OPTIONS, allow_blank=False, compact=True, id="model", disabled=True)
        yield Static("", id="about", markup=False)
        yield Button("Begin (F5)", variant="primary", compact=True, id="begin", disabled=True)

    def show(self, home: HomeView) -> None:
        """Show the choices of `home`; earlier selections are kept where they are still available."""
        self._home = home
        self._set_options(
            "#protocol",
            [(f"{line.name} (locked)" if line.locked else line.name, line.name) for line in home.protocols],
        )
        self._set_options(
            "#device",
            [(f"{name} (nothing moves)" if name == SIMULATED_DEVICE else name, name) for name in home.devices],
        )
        self._set_options("#model", [(_format_model_option(path, home), path) for path in home.models])
        suggested_code = suggest_code(tuple(session.subject for session in home.sessions if session.observer is None))
        self.query_one("#code", Input).placeholder = f"code, such as {suggested_code}"
        self.query_one("#begin", Button).disabled = not (home.protocols and home.devices)
        self._show_problem()

    def action_begin(self) -> None:
        self._submit()

    @on(Input.Submitted, "#code")
    @on(Button.Pressed, "#begin")
    def _submit(self) -> None:
        """Submit the form (see the class); does nothing while the button is disabled."""
        if self._home is None or self.query_one("#begin", Button).disabled:
            return
        code = self._code
        problem = explain_invalid_code(code) or self._describe_withdrawal(code)
        if problem or self._model_problem:
            self._show_message(problem or self._model_problem, "-problem")
            self.query_one("#code" if problem else "#protocol").focus()
            return
        model = self._read_selected_value("#model") if self._is_equalized else ""
        self.post_message(
            BeginRequested(code, self._read_selected_value("#protocol"), self._read_selected_value("#device"), model)
        )

    @on(Input.Changed, "#code")
    @on(Select.Changed)
    def _show_problem(self) -> None:
        """Show the problem of the present entries, else a notice on the code, else the title of the protocol."""
        if self._home is None:
            return
        code = self._code
        self.set_class(self._is_equalized, "-equalized")
        if code and not is_code(code):
            self._show_message(explain_invalid_code(code), "-problem")
        elif problem := self._describe_withdrawal(code):
            self._show_message(problem, "-problem")
        elif self._model_problem:
            self._show_message(self._model_problem, "-problem")
        elif notice := self._describe_earlier_sessions(code):
            self._show_message(notice, "-notice")
        else:
            protocol_name = self._read_selected_value("#protocol")
            self._show_message(
                next((entry.title for entry in self._home.protocols if entry.name == protocol_name), ""), ""
            )

    @property
    def _is_equalized(self) -> bool:
        """Whether the selected protocol equalizes its stimuli, and so needs a model."""
        protocol_name = self._read_selected_value("#protocol")
        return self._home is not None and any(
            protocol.equalized for protocol in self._home.protocols if protocol.name == protocol_name
        )

    @property
    def _model_problem(self) -> str:
        """Problem of a missing model, in words; empty if there is none."""
        if not self._is_equalized or self._read_selected_value("#model"):
            return ""
        return "This protocol needs a model, next to the data: hapteq record, hapteq identify."

    @property
    def _code(self) -> str:
        """The entered code of the participant, without spaces around it."""
        return self.query_one("#code", Input).value.strip()

    def _describe_withdrawal(self, code: str) -> str:
        """Describe the problem of a code whose participant withdrew; empty for other codes."""
        return next((f"{code} withdrew: this code is not given again." for session in self._list_code_sessions(code)
                     if session.standing == "withdrawn"), "")  # fmt: skip

    def _describe_earlier_sessions(self, code: str) -> str:
        """Describe the earlier sessions with a valid code: an unfinished one of this protocol, else their number; empty
        for an unused code."""
        sessions, protocol_path = self._list_code_sessions(code), self._read_selected_value("#protocol")
        for session in sessions:
            if session.standing == "unfinished" and session.protocol == _extract_protocol_name(protocol_path):
                return (
                    f"{session.name} of this protocol is not finished. "
                    "Beginning makes another one; r in the list resumes."
                )
        if sessions:
            count_text = "a session" if len(sessions) == 1 else f"{len(sessions)} sessions"
            return f"{code} has {count_text} here already. Is it the same person?"
        return ""

    def _list_code_sessions(self, code: str) -> list[SessionLine]:
        """List the sessions of the participant with this code."""
        return [session for session in self._home.sessions if session.subject == code] if self._home and code else []

    def _read_selected_value(self, selector: str) -> str:
        """Read the selected value of a list; empty without a selection."""
        value = self.query_one(selector, Select).value
        return value if isinstance(value, str) else ""

    def _set_options(self, selector: str, options: list[tuple[str, str]]) -> None:
        """Set the options (text, value) of a list; the selection is kept where it is still available, else it is the
        first. Brackets in the texts, as in names of files, are no markup, and control characters are replaced."""
        select: Select[str] = self.query_one(selector, Select)
        previous_value = select.value
        values = [value for _, value in options or PLACEHOLDER_OPTIONS]
        option_texts = [
            Content(replace_unprintable(text).replace("\n", " ")) for text, _ in options or PLACEHOLDER_OPTIONS
        ]
        select.set_options(zip(option_texts, values, strict=True))
        select.disabled = not options
        select.value = previous_value if previous_value in values else values[0]

    def _show_message(self, text: str, css_class: str) -> None:
        """Show a text below the fields. css_class: -problem, -notice (both with a "! " before the text), or empty for
        the title of the protocol."""
        message_line = self.query_one("#about", Static)
        message_line.set_class(css_class == "-problem", "-problem")
        message_line.set_class(css_class == "-notice", "-notice")
        message_line.update(f"! {text}" if css_class else text)


def _format_model_option(path: str, home: HomeView) -> str:
    """Format a model in the list: its file name, and its quality where that is known."""
    quality = home.describe_quality(path)
    return f"{_extract_file_name(path)} ({quality})" if quality else _extract_file_name(path)


def _extract_file_name(path: str) -> str:
    """Extract the last part of a path with slashes or backslashes."""
    return path.replace("\\", "/").rpartition("/")[2]


def _extract_protocol_name(name_or_path: str) -> str:
    """Extract the name of a protocol that is given by name or path. Assumes that a file is named after its protocol."""
    return name_or_path.replace("\\", "/").rpartition("/")[2].removesuffix(".toml")
