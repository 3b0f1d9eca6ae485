# %% [markdown]
# # Run a simulated study and analyse it
#
# Two simulated participants run the shipped protocol on the simulated device, in virtual time. The results are the
# files of a study with people: one folder per session, whose `trials.csv` has a row per trial.

# %%
import tempfile
from pathlib import Path

from analysis import analyse_study
from study import read_study_protocol, read_trials, simulate_session

data = Path(tempfile.mkdtemp(prefix="hapteq-example-"))
protocol = read_study_protocol("direction_threshold")
sessions = [
    simulate_session(protocol, data, observer="ideal", subject=f"ideal{number}", seed=number) for number in (1, 2)
]
[session.name for session in sessions]

# %% [markdown]
# The analysis takes trials and their protocol, and returns values: thresholds per run, the analysis of variance as
# published and the analysis of variance within participants, warnings.

# %%
trials = [trial for session in sessions for trial in read_trials(session.path / "trials.csv")]
results = analyse_study(trials, protocol.protocol)
results

# %%
for threshold in results.thresholds[:5]:
    print(f"{threshold.subject}  {threshold.frequency_hz:g} Hz  {threshold.threshold_n:.3f} N")
