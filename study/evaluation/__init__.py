"""How well the product does its work: banks of concealed faults, real recordings, a lab's own test, the paper.

`challenge` (the reality of concealed cases; knows nothing of the diagnosis) -> `bank` (seal, answer, reveal, score:
`hapteq prove`) -> `real` (folders of recordings, faults injected under a seal: `hapteq real`); `kit` (a lab's own blind
test) and `reproduction` (the published figures) stand alone. Begin at `bank/prove.py`.
"""
