"""Parts of screens: each turns values into cells, without rules.

Of a trial: `session_bar`, `direction_panel`, `handle_target`. Of forms: `form_question` with `choice_row`,
`new_session_form`. Of past sessions: `session_table`, `staircase_plot`. Of any screen: `card`, `long_text`,
`text_table`, `literal_text`. Begin at `direction_panel.py`.
"""
