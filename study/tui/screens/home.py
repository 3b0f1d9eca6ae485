"""The start screen: a form to begin a new session, and the list of sessions.

It appears before the engine has read the list of sessions, which is filled in later (`HomeScreen.show`)."""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Vertical, VerticalScroll
from textual.screen import Screen
from textual.widgets import Footer, Input, Static

from study.session.views.archive_views import HomeView
from study.tui.home_messages import HomeRequested
from study.tui.screens.browse import BrowseScreen
from study.tui.screens.diagnose_form import DiagnoseForm
from study.tui.screens.sensor import SensorScreen
from study.tui.session_status import describe_session
from study.tui.widgets.new_session_form import NewSessionForm
from study.tui.widgets.session_table import SessionTable

LOADING_TEXT = "Looking for sessions…"
"""Text that is shown until the list of sessions is loaded."""

EMPTY_LIST_TEXT = """\
No sessions here yet. To begin with:

1  Try it as a participant would: type the code P00 and press F5.
   With the simulated device nothing moves.
2  See a whole study: [b]hapteq rehearse[/b] in a terminal lets ten
   simulated participants take it, with a report.
3  Read the protocol, each value with its reason:
   [b]hapteq protocol show direction_threshold[/b]
4  Keep it as it is, before the first real participant:
   [b]hapteq protocol lock direction_threshold[/b]

F1 explains this screen.\
"""
"""Text that is shown in place of an empty list of sessions."""

GUIDE_TEXT = """\
[b]A study day[/b]

1  Is the device fit? [b]hapteq doctor[/b]
2  Type the code, press F5. Consent,
   instructions and practice follow.
3  In a second terminal: [b]hapteq watch SESSION[/b]
4  Afterwards: F3 and Enter for the results.

[b]Status[/b]

✓  finished: all runs are done
◐  unfinished: every answer is safe; r resumes
▶  running now; w watches
○  refused or excluded: takes no part
✕  withdrawn: the data were erased
!  unreadable: Enter says why
"""
"""Text that is shown below the form if the terminal has at least 120 columns."""

HELP = """\
# The start

**New session** (F2). Type the participant's code, choose protocol and device, and press F5. A code has 1 to 16 letters
and digits, with at least one digit, such as P01. Names stay off this computer. A protocol whose stimuli are
accelerations also needs a model of the device, in the data folder or next to it (`hapteq identify` makes it).

**Sessions** (F3), latest first. The arrow keys move, and:

* **Enter** opens a session: thresholds, staircases, log, report, withdrawal.
* **r** resumes one that is not finished: ◐.
* **w** watches one that is running: ▶.

| | |
|---|---|
| ✓ finished | all runs are done |
| ◐ unfinished | it can be resumed; every answer is on disk |
| ▶ running | another program writes it right now |
| ○ refused, ○ excluded | the person does not take part; nothing was played, and the session is over |
| ✕ withdrawn | the participant withdrew; the data were erased |
| ! unreadable | its log cannot be used; opening it says why |

**F4** opens a diagnosis or a session from anywhere. **F8** diagnoses recordings: what does a model of the device lack?
**F7** calibrates the accelerometer of a real device. **F6** looks again. **Tab** goes from field to field.

In a terminal: `hapteq study --subject P01`, `hapteq sessions`, `hapteq show SESSION`, `hapteq resume SESSION`.
"""
"""Help of the screen, in Markdown."""


class HomeScreen(Screen[None]):
    """Form of a new session, and list of sessions. F2 and F3 move to form and list, F4 opens a file, F6 reads the
    list again, F7 calibrates the accelerometer, F8 diagnoses recordings. Requests are posted as messages of
    `study.tui.home_messages`. home: content; None if it is not loaded yet."""

    HELP = HELP
    CSS = """
    HomeScreen #name { height: auto; min-height: 1; padding: 0 1; background: $primary-muted; color: $foreground; }
    HomeScreen #body { layout: vertical; height: 1fr; }
    HomeScreen #past { height: 1fr; border: round $primary; padding: 0 1; }
    HomeScreen #past:focus-within { border: round $accent; }
    HomeScreen SessionTable {
        height: 1fr; display: none; background: $background; scrollbar-size-horizontal: 0;
    }
    HomeScreen #detail { height: 2; color: $foreground 65%; }
    HomeScreen #empty { height: 1fr; display: none; }
    HomeScreen.-wide #body { layout: horizontal; }
    HomeScreen #left { height: auto; }
    HomeScreen #guide { display: none; height: 1fr; border: round $panel; padding: 0 1; color: $foreground 80%; }
    HomeScreen.-wide #left { width: 50; height: 1fr; }
    HomeScreen.-wide #guide { display: block; }
    HomeScreen.-wide NewSessionForm #about { height: 4; margin-top: 1; }
    """
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012  # no ClassVar in the base class
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f2", "new", "New"),
        Binding("f3", "past", "Sessions"),
        Binding("f4", "browse", "File"),
        Binding("f8", "diagnose", "Diagnose"),
        Binding("f7", "sensor", "Sensor"),
        Binding("f6", "look_again", "Refresh", show=False),
    ]

    def __init__(self, home: HomeView | None = None) -> None:
        super().__init__()
        self._home = home

    def compose(self) -> ComposeResult:
        yield Static("hapteq", id="name", markup=False)
        with Container(id="body"):
            with Vertical(id="left"):
                yield NewSessionForm(id="new")
                yield Static(GUIDE_TEXT, id="guide")
            with Vertical(id="past") as session_box:
                session_box.border_title = "Sessions"
                yield SessionTable(id="sessions")
                with VerticalScroll(id="empty"):
                    yield Static(EMPTY_LIST_TEXT)
                yield Static(LOADING_TEXT, id="detail", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.query_one("#code", Input).focus()
        if self._home is not None:
            self._show_content(self._home)

    def show(self, home: HomeView) -> None:
        """Show new content; the user's entries in the form are kept. Before the first frame, the content is only
        stored, and shown with that frame."""
        self._home = home
        if self.query("#name"):
            self._show_content(home)

    def _show_content(self, home: HomeView) -> None:
        """Fill form and list, or show the hints for an empty list."""
        self.query_one("#name", Static).update(f"hapteq   force-direction studies   data: {home.data}")
        self.query_one(NewSessionForm).show(home)
        has_sessions = bool(home.sessions)
        self.query_one("#past", Vertical).border_title = (
            f"Sessions ({len(home.sessions)})" if has_sessions else "Sessions"
        )
        table = self.query_one(SessionTable)
        table.display = has_sessions
        self.query_one("#empty").display = not has_sessions
        self.query_one("#detail", Static).update("")
        self.query_one("#detail").display = has_sessions
        table.show(home.sessions)
        if has_sessions and self.query_one("#empty").has_focus:  # F3 was pressed before the list was loaded
            table.focus()

    @on(SessionTable.CursorMoved)
    def _show_session_description(self, event: SessionTable.CursorMoved) -> None:
        """Describe the session under the cursor below the list."""
        self.query_one("#detail", Static).update(describe_session(event.line))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable F2 or F3, and hide it in the footer, while the focus is in its half of the screen already."""
        selector = {"new": "#new", "past": "#past"}.get(action)
        return selector is None or not self.query_one(selector).has_focus_within

    def action_new(self) -> None:
        self.query_one("#code", Input).focus()

    def action_past(self) -> None:
        has_sessions = self._home is not None and self._home.sessions
        self.query_one("#sessions" if has_sessions else "#empty").focus()

    def action_browse(self) -> None:
        self.app.push_screen(BrowseScreen(self._home.data if self._home else "."))

    def action_diagnose(self) -> None:
        self.app.push_screen(DiagnoseForm())

    def action_sensor(self) -> None:
        self.app.push_screen(SensorScreen())

    def action_look_again(self) -> None:
        self.query_one("#detail", Static).update(LOADING_TEXT)
        self.post_message(HomeRequested())
