"""Widgets from which the screens are composed: each draws values and reports input, and decides nothing about a study.

For a trial: `session_bar`, `direction_panel`, `handle_target`. For forms: `form_question` with `choice_row`. For the
start screen: `new_session_form`, `session_table`. For a past session: `staircase_plot`. For any screen: `card`,
`long_text`, `text_table`, `literal_text`. Used by `study.tui.screens`. Begin at `direction_panel.py`.
"""
