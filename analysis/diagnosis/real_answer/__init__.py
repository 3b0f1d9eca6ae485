"""Document of the diagnosis of one real recording, format `hapteq-real-answer`.

`make_real_answer` converts the findings of a diagnosis to a `real_answer`. Used by `study.evaluation.real`
(`hapteq real`), which writes it to a file and to the report. Begin at `real_answer.py`.
"""
