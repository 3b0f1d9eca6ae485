"""Reports: results and pictures of an analysis -> sections and tables -> a self-contained HTML page.

`page` defines the structure of a report and renders it. One file per report: `study_report` (its parts:
`declared_section`, `study_tables`, `primary_tables`, `supplementary_tables`, `cue_section`, `methods_text`),
`diagnosis_report` (`diagnosis_tables`, `diagnosis_distortion`, `diagnosis_method`), `real_report` (`injected_section`),
`look_report`, `identification_report`, `blind_test_report`, `reproduction_report`. Used by `study.workflows` and
`study.evaluation`, which write the page. Begin at `page.py`, then `study_report.py`.
"""
