"""Reports: values and figures as a self-contained page of HTML.

`page` is a report as a value, and its HTML. One file a report: `study_report` (sections: `declared_section`,
`study_tables`, `primary_tables`, `side_tables`, `cue_section`, `methods_text`), `diagnosis_report` (`diagnosis_tables`,
`diagnosis_distortion`, `diagnosis_method`), `real_report` (`injected_section`), `look_report`, `identification_report`,
`blind_test_report`, `reproduction_report`. Begin at `page.py`, then `study_report.py`.
"""
