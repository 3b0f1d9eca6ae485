# %% [markdown]
# # Write a protocol of your own
#
# A protocol is a TOML file: copy a shipped one, give it a name of its own, and change it. An invalid protocol is
# refused with a list of all its errors.

# %%
from protocols import begin_staircase, dump_protocol, load_protocol, planned_runs, staircase_level_n, step_staircase
from study import read_study_protocol

shipped = read_study_protocol("direction_threshold").text
TEXT = (
    shipped.replace('name = "direction_threshold"', 'name = "two_frequencies"')
    .replace("frequencies_hz = [5.0, 15.0, 25.0, 35.0, 45.0]", "frequencies_hz = [10.0, 30.0]")
    .replace("start_n = 1.0", "start_n = 0.8")
)
protocol = load_protocol(TEXT, "two_frequencies.toml")
print("\n".join(dump_protocol(protocol).splitlines()[:12]))

# %%
try:
    load_protocol(TEXT.replace("\ncap_n = 3.0", "\ncap_n = -3.0\ncap = 2.0"), "wrong.toml")
except ValueError as problem:
    print(problem)

# %% [markdown]
# The rule that decides the next level is a function of the rule, the state, and one answer.

# %%
rule = protocol.staircase
state = begin_staircase(rule)
for correct in (True, True, True, False, True, True, True):
    print(f"{staircase_level_n(rule, state):.3f} N, answered {'right' if correct else 'wrong'}")
    state = step_staircase(rule, state, correct)

# %%
for run in planned_runs(protocol, seed=1, participant_number=1):
    print(run.index, run.phase.value, f"{run.frequency_hz:g} Hz")
