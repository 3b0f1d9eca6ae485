"""Screen of one past session: its facts, thresholds, staircases, log and report, and the actions that it allows.

The screen shows a `SessionView` and posts messages, on which the application and its engine act.
"""

from pathlib import Path
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import ItemGrid, VerticalScroll
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Footer, Static, TabbedContent, TabPane

from study.session.views.archive_views import SessionView
from study.tui.drawing.staircase_drawing import LEGEND
from study.tui.engine.to_engine import Analyze, Withdraw
from study.tui.home_messages import CommandRequested, HomeRequested, ResumeRequested, WatchRequested
from study.tui.screens.diagnose_form import DiagnoseForm
from study.tui.screens.withdraw_prompt import WithdrawPrompt
from study.tui.session_status import describe_session, find_status_style, format_status
from study.tui.widgets.long_text import LongText
from study.tui.widgets.staircase_plot import StaircasePlot
from study.tui.widgets.text_table import TextTable

PAGES = ("overview", "thresholds", "staircases", "log", "report")
"""Pages, in the order of the keys 1 to 5."""

HELP = """\
# A session

**1** to **5** choose a page; the arrow keys, PageUp and PageDown scroll it.

* **1 Overview**: who, what, when, and what to know about it.
* **2 Thresholds**: one row per run. "cut by the cap": the strongest force allowed was not enough, and the true
  threshold may lie elsewhere.
* **3 Staircases**: force over trials. ○ right, × wrong, ▼ ▲ reversals (a peak, a valley), ┄ the cap, ··· the threshold.
* **4 Log**: everything that happened, in words.
* **5 Report**: where report and figures lie. **o** opens the report in the browser.

**r** resumes an unfinished session. **a** writes tables, figures and report anew. **w** watches a running one.
**d** diagnoses the device by this session's trials. **x** withdraws the participant: all data of this code are erased,
after you typed the code. **Esc** goes back.

In a terminal: `hapteq show SESSION`, `hapteq resume SESSION`, `hapteq analyze SESSION`, `hapteq withdraw SESSION`.
"""
"""Help of the screen, in Markdown."""


class SessionScreen(Screen[None]):
    """One past session on five pages, which the keys 1 to 5 select. r resumes the session, w watches it, a analyses it,
    d diagnoses the device, x withdraws the participant, o opens the report, Esc returns to the start screen;
    `check_action` disables actions that the session does not allow."""

    HELP = HELP
    CSS = """
    SessionScreen #head { height: auto; min-height: 1; padding: 0 1; background: $primary-muted; }
    SessionScreen TabbedContent { height: 1fr; }
    SessionScreen TabPane { padding: 0 1; height: 1fr; }
    SessionScreen TabPane > VerticalScroll { height: 1fr; }
    SessionScreen .part { height: auto; margin-top: 1; }
    SessionScreen #staircase-list { grid-rows: 14; grid-gutter: 1 3; height: auto; }
    SessionScreen #legend { height: 1; color: $foreground 65%; }
    SessionScreen #wide-table { overflow-x: auto; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "back", "Back", key_display="Esc"),
        Binding("r", "resume", "Resume"),
        Binding("w", "watch", "Watch"),
        Binding("a", "analyze", "Analyze"),
        Binding("o", "open_report", "Open report"),
        Binding("d", "diagnose", "Diagnose"),
        Binding("x", "withdraw", "Withdraw"),
        *(
            Binding(str(page_number), f"page('{tab}')", tab, show=False)
            for page_number, tab in enumerate(PAGES, start=1)
        ),
    ]

    def __init__(self, view: SessionView) -> None:
        super().__init__()
        self._view = view

    def show(self, view: SessionView) -> None:
        """Show a newer view, such as after an analysis; the selected page is kept."""
        page = self.query_one(TabbedContent).active
        self._view = view

        async def redraw() -> None:
            """Compose the screen again, and select the page that was selected before."""
            await self.recompose()
            self.query_one(TabbedContent).active = page
            self.refresh_bindings()

        self.call_later(redraw)

    def compose(self) -> ComposeResult:
        view = self._view
        yield Static(_make_title_line(view), id="head")
        with TabbedContent(initial="overview"):
            with TabPane("1 Overview", id="overview"), VerticalScroll():
                yield Static(describe_session(view.line), markup=False)
                yield Static(_make_facts_table(view.facts), classes="part")
                yield Static("[b]To know[/b]", classes="part")
                yield Static(_make_warning_list(view.warnings))
            with TabPane("2 Thresholds", id="thresholds"), VerticalScroll(id="wide-table"):
                yield from _compose_thresholds(view)
            with TabPane("3 Staircases", id="staircases"):
                yield Static(LEGEND if view.staircases else "No run has an answer yet.", id="legend", markup=False)
                with VerticalScroll(), ItemGrid(min_column_width=56, id="staircase-list"):
                    for staircase in view.staircases:
                        yield StaircasePlot(staircase)
            with TabPane("4 Log", id="log"):
                yield LongText(view.events or ("Nothing can be read.",))
            with TabPane("5 Report", id="report"), VerticalScroll():
                yield Static(_make_report_text(view), markup=False)
        yield Footer(show_command_palette=False)

    def on_tabbed_content_tab_activated(self) -> None:
        """Focus the new page, so that arrow keys scroll it at once."""
        self._focus_page()

    def action_page(self, tab: str) -> None:
        self.query_one(TabbedContent).active = tab
        self._focus_page()

    def _focus_page(self) -> None:
        """Focus the widget of the selected page that scrolls."""
        page = self.query_one(TabbedContent).active_pane
        if page is not None:
            for scrollable in page.query("VerticalScroll, LongText"):
                scrollable.focus()

    def action_back(self) -> None:
        self.post_message(HomeRequested())

    def action_resume(self) -> None:
        self.post_message(ResumeRequested(self._view.line.path))

    def action_watch(self) -> None:
        self.post_message(WatchRequested(self._view.line.path))

    def action_analyze(self) -> None:
        self.notify("Analyzing. The report is refreshed when it is done.")
        self.post_message(CommandRequested(Analyze(self._view.line.path)))

    def action_diagnose(self) -> None:
        self.app.push_screen(DiagnoseForm(self._view.line.path))

    def action_open_report(self) -> None:
        open_report(self.app, self._view.report)

    def action_withdraw(self) -> None:
        """Ask for confirmation, and request the withdrawal where it is given."""

        def request_if_confirmed(is_confirmed: bool | None) -> None:
            """Request the withdrawal where the dialog returned True."""
            if is_confirmed:
                self.post_message(CommandRequested(Withdraw(self._view.line.path)))

        self.app.push_screen(WithdrawPrompt(self._view.line.subject), request_if_confirmed)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Whether this session allows an action; the footer shows only allowed actions."""
        line = self._view.line
        match action:
            case "resume":
                return line.standing == "unfinished"
            case "watch":
                return line.standing == "running"
            case "analyze" | "diagnose":
                return line.standing in ("finished", "unfinished") and line.answers > 0
            case "open_report":
                return bool(self._view.report)
            case "withdraw":
                return line.standing not in ("withdrawn", "running")
        return True


def make_file_url(path: str) -> str:
    """Make the file URL of a path, for a browser on this machine."""
    return Path(path).absolute().as_uri()


def open_report(app: App[object], path: str) -> None:
    """Open an HTML report in a browser of this machine. Where the screen itself runs in a browser, the file's content
    is sent to a new tab, because a browser refuses links from a served page to a local file; a file that cannot be read
    is then reported by a notification."""
    if app.is_web:
        try:
            app.deliver_binary(path, open_method="browser", mime_type="text/html")
        except OSError as problem:
            explanation = f"{problem.strerror or problem}: {path}. Make it anew, or open it where it is now."
            app.notify(explanation, title="The report cannot be opened", severity="error", markup=False)
    else:
        app.open_url(make_file_url(path))


def _make_title_line(view: SessionView) -> Content:
    """Make the first line of the screen: name, status and protocol of the session."""
    line = view.line
    parts: list[Content | str | tuple[str, str]] = [
        (line.name, "bold"),
        "   ",
        (format_status(line.standing), find_status_style(line.standing)),
        f"   {line.protocol}",
    ]
    return Content.assemble(*parts)


def _make_facts_table(facts: tuple[tuple[str, str], ...]) -> Table:
    """Make a table of two columns from facts (name, value), of which the second wraps."""
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim", no_wrap=True)
    table.add_column()
    for name, value in facts:
        table.add_row(Text(name), Text(value))
    return table


def _make_warning_list(sentences: tuple[str, ...]) -> Table:
    """Make a bulleted list of warnings; the sentence "Nothing stands out." where there are none."""
    table = Table.grid(padding=(0, 1, 0, 0))
    for sentence in sentences or ("Nothing stands out.",):
        table.add_row("•", Text(sentence))
    return table


def _compose_thresholds(view: SessionView) -> ComposeResult:
    """Compose the table of thresholds and its explanation; a sentence where no run is complete."""
    if not view.thresholds:
        yield Static("No test run is complete, so there is no threshold yet.", markup=False)
        return
    yield TextTable(view.thresholds)
    yield Static(
        Content.styled(
            "Thresholds: mean of the last peaks and valleys, or of Psi's posterior. Delivered: acceleration "
            "along the direction at threshold. Rev.: reversals. Cut by the cap: the strongest force allowed was met.",
            "$foreground 65%",
        ),
        classes="part",
    )


def _make_report_text(view: SessionView) -> str:
    """Make the text of the report page: paths of report and figures, and the warnings; without a report, how to make
    one, where that is possible."""
    if not view.report:
        lines = ["No report was written yet."]
        if view.line.standing in ("finished", "unfinished") and view.line.answers:
            lines.append("a analyzes the session: tables, figures and a report.")
        return "\n".join(lines)
    figures = [f"  {Path(path).name:28} {path}" for path in view.figures] or ["  none"]
    warnings = [f"  • {warning}" for warning in view.warnings] or ["  none"]
    return "\n".join(
        [
            view.report,
            "",
            "o opens it in the browser, a writes it anew.",
            "",
            "Warnings",
            *warnings,
            "",
            "Figures",
            *figures,
        ]
    )
