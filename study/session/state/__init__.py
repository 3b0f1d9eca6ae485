"""State of a session, computed from its log alone, and the next action that follows from the state.

Order of the data: logged events -> `fold`, `fold_trial` (apply each event; `presentation_check` compares each
presentation with the expected one) -> `state`, with `sitting_state`, `probe_state`, `daily_dose`, `vibration_dose` as
its parts -> `machine` (next action) -> `due_trial` (the presentation to play). `rules` states the differences between
versions of the rules, `progress` the participant's progress. Used by `study.workflows` and `study.session.watching`.
Begin at `fold.py`.
"""
