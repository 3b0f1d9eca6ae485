"""The numbers that the diagnosis decides by, in one table; those of the force balance stand at the head of its files.

Purely numerical tolerances stay where they are used.

Errors are rms errors over rms noise, 1 = noise alone; where one number stands for several channels, the worst counts.
A gain is a difference of mean log error power, over the channels, between two fits (`FitScore.mean_log_error`).

Where a number comes from:

* principle: it follows from the sentence beside it;
* a name and a year: from the literature;
* bank: it was set by what a bank of simulated devices showed (docs/proof.md), named by its first seed;
* hand: it was set by hand during development, on simulated devices that no bank reports (docs/proof.md).
"""

from math import log

# What can be compared at all (`input_checks`). By hand.
LEAST_SAMPLES = 256  # with a response, in all recordings: fewer carry neither a fit nor a test
SHORTEST_S, SHORTEST_SAMPLES = 1.5, 2000  # what lasts less and holds fewer is explained as well by any effect
LEAST_SAMPLES_TO_FIT = 64  # with a response, of what may be fitted to
LEAST_CYCLES = 3.0  # in all recordings, of the frequency below which three quarters of the commands' power lie
CYCLES_SHARE = 0.75  # a step is no cycle: 0.81 of its power lies in a single line; random levels that drift are many
BRIDGED = 0.02  # of the command's spread, by which straight lines may miss it over a gap of that length; by hand
LEAST_KEPT = 0.5  # of the samples with a command that must lie in stretches worth comparing; principle: the main part
LARGEST_VALUE = 1e12  # SI; principle: far beyond any device, and its powers are still numbers
MOST_GROWTH = 1.0  # e-foldings of a model by itself over the longest recording; principle: rounding stays far below
ANSWER_DEVIATIONS = 5.0  # standard deviations of coherence above noise alone, from which the device answers
ANSWER_COHERENCE = 0.5  # coherence that must stand out twice as far, or the recordings are too short to be judged

# How samples are split, and how well a model is trusted (`observe`). By hand.
MODEL_FLOOR = 0.002  # share of a channel's rms that counts as noise; principle: no model is exact
LEVELS_TO_STRATIFY = 2  # principle: with more than one, the end of the time would hold one alone
LEVELS_TO_HOLD_ONE_BACK = 3  # principle: a level to choose by lies between two that are fitted to
CHOOSE_SHARE = 0.25  # of the fitting time, from its end, where no level can be kept back to choose by
TEST_SHARE = 0.25  # of the time, or of each part's motion, from its end, where no segment has a role
AT_REST = 0.02  # of the range of a response, within which it rests where a part of the recording ends
LONGEST_TAIL = 0.05  # of a part, which may rest at its end without another split; where it rests is told from it
STILL_SHARE = 0.01  # of the mean square of the motion that is fitted, below which what is held out tests nothing

# Which error measure suits (`measure_rule`, `closed_loop`). By hand.
FED_BACK_SHARE = 0.1  # of the command's rms that must differ from the recorded excitation: then the loop is closed
FORETOLD_SHARE = 0.05  # of what its own past leaves of a command that the responses may leave (test of Granger 1969)
DIES_OUT_SHARE = 1 / 3  # of the longest record, within which a plant that holds itself comes to rest
SETTLED_CONSTANTS = 5.0  # time constants after which a motion is gone; principle: exp(-5) is below 1 %
MOST_LEFT_OUT = 0.25  # share of a recording that may be left out until then
REST_SHARE = 0.5  # of a channel's rms that it may start with, and of its usual changes that it may change by
REST_S = 0.02  # within this time at the start; principle: an offset alone is no motion
LAWS_WITHIN = 0.95  # of each named law's power that a band must hold for forces to be compared in it alone
UNKNOWN_NOISE_SHARE = 1e-3  # of the signal, taken for noise where a recording cannot tell

# How far the model's own numbers may move (`tuning`, `output_error`, `rigid_model`). By hand.
RETUNING_BOUND = 4.0  # standard deviations of the calibration
UNSTATED_SHARE = 0.1  # one standard deviation of what has no stated tolerance, of the largest at any axis
UNSTATED_MODES = 0.02  # the same of a mode's frequency
RIGID_SHARE, RIGID_MASS_SHARE = 0.25, 0.05  # the same of damping and stiffness, and of mass, of a fitted rigid model
MASSLESS_SHARE = 1e-3  # of the force's rms: the inertia of a body that shows none; principle: far below any error
SPRING_SHARE = 0.05  # of the misfit that springs must take to be part of it
RETUNING_NAMED, RETUNING_DOUBTED = 1.0, 3.0  # standard deviations from which a moved number is named, and doubted

# Where a mismatch sits (`mismatch_cells`, `level_trends`, `entry_point`, `find_tied_states`). By hand.
FALSE_DISCOVERY_RATE = 0.01  # of cells and states, by the test of Benjamini and Bogomolov (2014)
DISTORTION_P = 0.001  # p-value below which a kind of distortion is there
STEADY_DB = 1.5  # change of distortion per doubling of the level that is neither rising nor falling
ENTRY_ANGLE = 0.1  # mean sine between two entries' directions below which they cannot be told apart
ENTRY_LOUD = 3.0  # times its noise, in power, that a residual must be on a line to count
ENTRY_PER_DIMENSION = 0.25  # score that each further direction must gain; else model errors on other axes are forces
ENTRY_SENSOR_PENALTY = log(2.0)  # score against an entry that the comparison of position and response speaks against
ENTRY_LEAST_LINES = 40  # loud lines below which nothing is said of where a mismatch enters
ENTRY_AS_GOOD_P = 0.05  # p-value above which the next entry would explain it about as well
SENSOR_SHOWN = 4.0  # times the position's noise, in power, that the response's residual must bring there to be missed
SENSOR_LOUD = 10.0  # times its own noise, in power, that the response's residual must be on such a line
SENSOR_LEAST_LINES = 5
SENSOR_ABSENT, SENSOR_PRESENT = 0.1, 0.5  # share of it below which position lacks it, above which position shows it
STATE_CROWDED = 1.5  # share of a mismatch in a region of state, over the region's share of the samples
STATES_NAMED = 2  # per axis or channel; principle: what depends on one state is seen in others, too

# Which hypotheses are tried and fitted (`starting_hypotheses`, `screening`, `search_context`). By hand.
STARTS_PER_CLAIM = 4
WEAKEST_START, STRONGEST_START = 0.1, 6.0  # factors by which a starting value's strength may be wrong
MOST_FITTED, LEAST_FITTED = 10, 4  # hypotheses that get a first fit
WORTH_FITTING = 0.2  # share of the best one's foreseen gain that another must foresee
MOST_REFINED = 3  # fits that are taken to the end
WORTH_REFINING = 0.5  # share of the best one's gain that such a fit must have gained
SAME_START = 0.01  # of what two starts of a law leave, that they may differ by to be one
SHARED_MOTION = 0.05  # of an effect's gain, that two laws may differ by to share what the model's own numbers do
NO_SECOND_START = 1.08  # error up to which a fit needs no second start
REACHES_NOISE = 2.0  # error after three steps up to which a fit is taken on where the best is noise alone already
RICHER_LAW_SQUARES = 4.0  # squares of the noise, in sum, that more numbers must gain over a law that does the same
CLOCK_TRIALS_PER_PERIOD, MOST_CLOCK_TRIALS = 6, 120  # of the response's middle frequency, at the recording's end
CLOCK_LEAST_SHARE = 1e-3  # of the misfit that a trial of clock drift must take

# What of a periodic recording laws are compared on first (`short_recordings`).
RUN_IN_CONSTANTS = 7.0  # time constants of the model's run-in; principle: exp(-7) is below a thousandth
SHORT_SHARE = 0.7  # of the samples, above which the whole is simulated at once; by hand

# Whether a further effect is looked for, and added (`explain`). By hand.
MOST_EFFECTS = 3
NOISE_ALONE = 1.05  # error that counts as noise alone
SEALED_SURPRISE = 1.15  # error of the re-tuned model on sealed samples from which an effect is looked for all the same
SEARCH_ON = 1.12  # error from which a further effect is looked for; principle: laws of real physics are never exact
ADDED_SHARE = 0.15  # of what is left above the noise that an effect must take to be added,
ADDED_GAIN = 0.003  # and the least gain

# Which of several explanations is preferred (`same_within_errors`, `parsimony`). By hand.
NOISE_KNOWN_TO = 0.01  # gain that the best of models may leave; principle: a noise is not known better
AS_GOOD_GAIN = 0.0015  # gain below which explanations are as good: a hundred times chance in a minute of six channels
AS_GOOD_SHARE = 0.1  # or as a share of what the better one leaves above the noise
REFINED_GAIN = 0.006  # that a refined law must have over the plain law that it contains,
REFINED_SHARE = 0.35  # or as a share of what the plain law leaves: where both are wrong, the richer one errs less
REFINED_FRICTION_SHARE = 0.7  # of dry friction: its reversal differs from device to device, any number takes some of it
REFINED_MOST_GAIN = 0.7  # principle: half of the error power is more than plainness makes up for

# What a search found is taken back (`prune`, `identifiability`, `no_answer`).
LAST_EFFECT_SHARE = 0.1  # of the mismatch. Bank 93000: below, four of five were wrong; right ones took a fifth or more
UNDETERMINED_REACH = 5.0  # interval over distance from none, beyond which no profile is asked. Bank 93000: wrong from 6
REPLACEMENTS_TRIED = 2  # by hand
NO_PREDICTION_SHARE = 0.9  # of its signal that an explanation may leave in every channel; by hand
NO_PREDICTION_ERROR = 3.0  # by hand

# The verdict (`verdict`, `search`). By hand, but where a bank is named.
EXPLAINED_ERROR = 1.12  # as good as noise; principle: laws of real physics are never exact
CONVINCING_SHARE, CONVINCING_ERROR = 0.93, 1.3  # of the mismatch taken; then so is this: real friction reverses rounder
HELD_OUT_ERROR = 1.5  # on sealed samples. Bank 93000: 169 of 172 right explanations below, three of nine wrong above
NAMED_ERROR = 3.0  # up to which what was found is named beside a remainder;
NAMED_SHARE = 0.9  # above, where it explains this share of the mismatch,
NAMED_GAIN = 1.6  # or gains this, four fifths of the error power: noise may be small beside all physics
EXPLAINED_BY_CHANCE = 2.5  # error over chance, where a statistic is compared; principle: no law of a contact is exact
CONFIRMED_SHARE = 0.3  # of the mismatch, in logarithms, that must fall on sealed samples,
SEALED_TOO_SMALL = 0.05  # unless it is smaller there than this
SEALED_ALONE_ERROR, SEALED_ALONE_TIMES = 1.25, 1.5  # on sealed samples, and over that on all others: half are opened

# Faults that a recording shows by itself (`model_free_faults`). By hand.
STEP_FACTOR = 1.5  # times a reference device's steps, from which on steps are others
READINGS_LEAST = 8  # readings at a limit, or there twice, that are no chance,
READINGS_FACTOR = 3.0  # times what a device in order has of them,
READINGS_DEVIATIONS = 5.0  # and by so many standard deviations of such a count
LEARNED_TOO_MUCH = 0.3  # share of the signal from which what a device in order differs by hides too much

# Rattling play (`impacts`). By hand.
VARIES_ERROR = 3.0  # rms between periods, over the noise, from which a response is irregular
PEAKED_KURTOSIS = 10.0  # or of what is left, where nothing repeats; 3 for noise
IMPACTS_LEAST_SPREAD = 0.05  # rms of a logarithm of amplitude; principle: no simulation foresees it better
IMPACTS_SHARE, IMPACTS_ERROR = 0.6, 3.0  # of the linear model's misfit to be taken, and most that is left over chance
IMPACTS_AS_GOOD = 1.1  # times the named one's misfit, up to which a rival is as good

# Numbers and probabilities of what is named (`named_effects`).
MOST_RIVALS = 6
INTERVAL_FACTOR, INTERVAL_SHARE = 2.5, 0.005  # of the noise's, and of the number. Bank 91000: noise alone held 65 %
PROBABILITY_SCALE = 0.002  # gain that makes a candidate e times less likely. Bank (docs/proof.md), as the next two
ELSEWHERE_LEAST, ELSEWHERE_MOST = 0.01, 0.8  # chance that none is right: where noise is left, where much more is
ELSEWHERE_HALFWAY, ELSEWHERE_STEEPNESS = 0.35, 1.5  # error above noise at which that is even, and how fast it turns

# What is said and proposed (`wording`, `unit_doubt`, `next_experiment`). By hand.
SAME_TO_READERS = 1.05  # ratio of errors that count as the same
FIT_CONFIRMED = 1.25  # held-out error over the error on what was fitted
UNIT_FACTOR, UNIT_CORRELATION = 5.0, 0.9  # factor from which a unit is doubted, where courses correlate so well
TELLING_GAIN = 10.0  # log likelihood below which a proposed recording would leave rivals as good as each other

# A law without a name (`discovery`). By hand, but where a principle is named.
LAW_BLOCKS = 6  # least number of stretches that held-out errors are taken over
LAW_POWER_KEPT = 0.999  # share of the commands' power within the band that laws are ranked in
LAW_REFINED, LAW_BEAM = 6, 4  # starts whose free numbers are fitted; sums that are kept
LAW_MOST_TERMS = 2  # along one axis at once; more are added round by round
LAW_MAIN_PART = 0.3  # of the misfit that one term may leave; beyond, a sum is looked for
LAW_ALMOST_NOISE = 1.1  # held-out error power along an axis, 1 = noise, below which no law is looked for
LAW_WORTH_SHARE = 0.4  # of what is left above the noise that a further term must take
LAW_AXES_SHARE = 0.3  # of the largest held-out misfit that a second axis needs, to be searched at once
LAW_FITTED, LAW_FITTED_WITHIN = (
    3,
    3.0,
)  # sums that are fitted by output error: of the best one's remainder, so many times
LAW_MOST_ROUNDS = 3  # laws that are added one after the other
LAW_SNAP = 0.003  # relative: so near a simple exponent, and so much more error, change nothing for a reader
LAW_BEATS = 0.5  # of a catalogue rival's excess that a law may leave at most
LAW_STABLE = 0.2  # jackknife error of a factor over stretches, as a share; principle: five standard errors from none
LAW_PLACEBO = 0.5  # of what chance leaves of a shuffled force, that a law may leave of the missing one at most
LAW_SAME = 0.05  # of what a law foretells: laws that are no further apart are one, written in two ways (issue 16)
LAW_NEAR = 0.03  # of a whole or half exponent, that is then no number to be told
