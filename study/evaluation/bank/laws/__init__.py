"""A bank of concealed laws (terms outside the effect catalogue), for a blind test of law discovery.

`seal_laws` (draw and seal) -> `prove_laws` (diagnose in separate processes, reveal, score) -> `write_law_proof`. Used
by `study.cli.prove` (`hapteq prove`). Begin at `prove_laws.py`.
"""
