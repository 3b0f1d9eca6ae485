"""What screens, lines and lists may show: values only, light to import, without level, frequency or correctness.

`views` (a participant's display), `form_views` -> `forms` -> `form_entry` (questions and answers), `archive_views`
(past sessions); `local_time`, `printable` and `count_text` are small texts. Begin at `views.py`.
"""
