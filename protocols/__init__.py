"""What an experiment is: the numbers and rules that are fixed before a participant sits down. Pure; imports none of
our packages.

Rooms: `definition` (what a TOML file may say) -> `document` (text to protocol and back, hash, lock) -> `procedure`
(order, levels, draws). Read in this order:

`staircase_rule` and `staircase` (the rule that decides the next level), `study_protocol` and
`recording_protocol` (what a TOML file may say), `schedule` (order and draws from keys), `trial` (the row that
everybody talks about), `loading` (text to protocol, every problem named), `hashing` and `lock` (fixed before data).

Decisions:

2026-11-21. Draws are keyed by (run, trial, attempt) and never sequential: a repeated or resumed trial shifts nothing.
2026-11-21. Defaults are filled in before a protocol is hashed, so a new field changes every hash: bump versions then.
"""
