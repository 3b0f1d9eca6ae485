"""The numbers that the diagnosis decides by, in one table: of the search by simulation, then of the force balance and
first models, then of the comparison with clean recordings.

Grids of starting values and purely numerical tolerances stay where they are used.

Errors are rms errors over rms noise, 1 = noise alone; where one number stands for several channels, the worst counts.
A gain is a difference of mean log error power, over the channels, between two fits (`FitScore.mean_log_error`).

Where a number comes from:

* principle: it follows from the sentence beside it;
* a name and a year: from the literature;
* bank: it was set by what a bank of simulated devices showed (docs/proof.md), named by its first seed;
* hand: it was set by hand during development, on simulated devices that no bank reports (docs/proof.md); of the force
  balance on five public recordings and invented axes, of the comparison with clean recordings on devices in order,
  halves of which were compared (docs/real.md).
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
LONGEST_TAIL = 0.05  # of a part, which may rest at its end without another split; where it rests is judged by it
STILL_SHARE = 0.01  # of the mean square of the motion that is fitted, below which what is held out tests nothing

# Which error measure suits (`error_measure_rule`, `closed_loop`). By hand.
FED_BACK_SHARE = 0.1  # of the command's rms that must differ from the recorded excitation: then the loop is closed
PREDICTED_SHARE = 0.05  # of what its own past leaves of a command that the responses may leave (test of Granger 1969)
DIES_OUT_SHARE = 1 / 3  # of the longest record, within which a plant that holds itself comes to rest
SETTLED_CONSTANTS = 5.0  # time constants after which a motion is gone; principle: exp(-5) is below 1 %
MOST_LEFT_OUT = 0.25  # share of a recording that may be left out until then
REST_SHARE = 0.5  # of a channel's rms that it may start with, and of its usual changes that it may change by
REST_S = 0.02  # within this time at the start; principle: an offset alone is no motion
LAWS_WITHIN = 0.95  # of each named law's power that a band must hold for forces to be compared in it alone
UNKNOWN_NOISE_SHARE = 1e-3  # of the signal, taken for noise where a recording cannot tell

# How far the model's own parameters may move (`tuning`, `output_error`, `rigid_model`). By hand.
RETUNING_BOUND = 4.0  # standard deviations of the calibration
WIDER_RETUNING_BOUND = 12.0  # the same where the former leaves a mismatch (`move_model_further`). Pairs of 101700
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
ENTRY_ANGLE = 0.1  # mean sine between two entries' directions below which they are not distinguished
ENTRY_LOUD = 3.0  # times its noise, in power, that a residual must be on a line to count
ENTRY_PER_DIMENSION = 0.25  # score that each further direction must gain; else model errors on other axes are forces
ENTRY_SENSOR_PENALTY = log(2.0)  # score against an entry that contradicts the comparison of position and response
ENTRY_LEAST_LINES = 40  # lines above the noise below which nothing is said of where a mismatch enters
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
WORTH_FITTING = 0.2  # share of the best predicted gain that another candidate's must reach
MOST_REFINED = 3  # fits that are taken to the end
WORTH_REFINING = 0.5  # share of the best one's gain that such a fit must have gained
SAME_START = 0.01  # of what two starts of a law leave, that they may differ by to be one
SHARED_MOTION = 0.05  # of an effect's gain, that two laws may differ by to share what the model's own parameters do
NO_SECOND_START = 1.08  # error up to which a fit needs no second start
REACHES_NOISE = 2.0  # error after three steps up to which a fit is taken on where the best is noise alone already
RICHER_LAW_SQUARES = 4.0  # squares of the noise, in sum, that more parameters must gain over a law that does the same
CLOCK_TRIALS_PER_PERIOD, MOST_CLOCK_TRIALS = 6, 120  # of the response's middle frequency, at the recording's end
CLOCK_LEAST_SHARE = 1e-3  # of the misfit that a trial of clock drift must take

# What of a periodic recording laws are compared on first (`short_recordings`).
RUN_IN_CONSTANTS = 7.0  # time constants of the model's run-in; principle: exp(-7) is below a thousandth
RUN_IN_ERROR = 0.1  # error power that a run-in may add, of what is left to explain; by hand
SHORT_SHARE = 0.7  # of the samples, above which the whole is simulated at once; by hand

# Whether a further effect is looked for, and added (`explain`). By hand.
MOST_EFFECTS = 3
NOISE_ALONE = 1.05  # error that counts as noise alone
HELD_OUT_SURPRISE = 1.15  # held-out error of the re-tuned model from which an effect is looked for all the same
ADDED_SHARE = 0.15  # of what is left above the noise that an effect must take to be added,
ADDED_GAIN = 0.003  # and the least gain

# Which of several explanations is preferred (`parsimony`). By hand.
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
HELD_OUT_ERROR = 1.5  # on held-out samples. Bank 93000: 169 of 172 right explanations below, three of nine wrong above
NAMED_ERROR = 3.0  # up to which what was found is named beside a remainder;
NAMED_SHARE = 0.9  # above, where it explains this share of the mismatch,
NAMED_GAIN = 1.6  # or gains this, four fifths of the error power: noise may be small beside all physics
EXPLAINED_BY_CHANCE = 2.5  # error over chance, where a statistic is compared; principle: no law of a contact is exact
CONFIRMED_SHARE = 0.3  # of the mismatch, in logarithms, that must fall on held-out samples,
HELD_OUT_TOO_SMALL = 0.05  # unless it is smaller there than this
# times the noise, and the error on all others, that held-out samples must show to be opened in part (`open_milder`).
# Pairs of seeds 101000 and 101200
HELD_OUT_ALONE_ERROR = 1.25
LEAST_PART = 16  # samples of a part into which held-out stretches are cut
LOUDER = 1.05  # times the largest command elsewhere, from which on a stretch is louder

# Faults that a recording shows by itself (`model_free_faults`). By hand.
STEP_FACTOR = 1.5  # times a reference device's steps, from which on steps are others
READINGS_LEAST = 8  # readings at a limit, or there twice, that are no chance,
READINGS_FACTOR = 3.0  # times what a device in order has of them,
READINGS_DEVIATIONS = 5.0  # and by so many standard deviations of such a count
LEARNED_TOO_MUCH = 0.3  # share of the signal from which what a device in order differs by hides too much

# Rattling play (`impacts`). By hand.
VARIES_ERROR = 3.0  # rms between periods, over the noise, from which a response is irregular
PEAKED_KURTOSIS = 10.0  # or of what is left, where nothing repeats; 3 for noise
IMPACTS_LEAST_SPREAD = 0.05  # rms of a logarithm of amplitude; principle: no simulation predicts it better
IMPACTS_SHARE, IMPACTS_ERROR = 0.6, 3.0  # of the linear model's misfit to be taken, and most that is left over chance
IMPACTS_AS_GOOD = 1.1  # times the named one's misfit, up to which a rival is as good

# Numbers and probabilities of what is named (`named_effects`).
MOST_RIVALS = 6
INTERVAL_FACTOR, INTERVAL_SHARE = 2.5, 0.005  # of the noise's, and of the number. Bank 91000: noise alone held 65 %
MOST_BETWEEN_SEGMENTS = 5.0  # times the noise's standard error; jackknife over segments. Set on 99700 (docs/proof.md)
PROBABILITY_SCALE = 0.002  # gain that makes a candidate e times less likely. Bank (docs/proof.md), as the next two
ELSEWHERE_LEAST, ELSEWHERE_MOST = 0.01, 0.8  # chance that none is right: where noise is left, where much more is
ELSEWHERE_HALFWAY, ELSEWHERE_STEEPNESS = 0.35, 1.5  # error above noise at which that is even, and how fast it turns

# What is said and proposed (`wording`, `unit_doubt`, `next_experiment`). By hand.
SAME_TO_READERS = 1.05  # ratio of errors that count as the same
FIT_CONFIRMED = 1.25  # held-out error over the error on what was fitted
UNIT_FACTOR, UNIT_CORRELATION = 5.0, 0.9  # factor from which a unit is doubted, where the signals correlate so well
TELLING_GAIN = 10.0  # log likelihood below which a proposed recording would leave rivals as good as each other

# A law without a name (`discovery`). By hand, but where a principle is named.
LAW_BLOCKS = 6  # least number of stretches that held-out errors are taken over
LAW_POWER_KEPT = 0.999  # share of the commands' power within the band that laws are ranked in
LAW_REFINED, LAW_BEAM = 6, 4  # starts whose free parameters are fitted; sums that are kept
LAW_MOST_TERMS = 2  # along one axis at once; more are added round by round
LAW_MAIN_PART = 0.3  # of the misfit that one term may leave; beyond, a sum is looked for
LAW_ALMOST_NOISE = 1.1  # held-out error power along an axis, 1 = noise, below which no law is looked for
LAW_WORTH_SHARE = 0.4  # of what is left above the noise that a further term must take
LAW_AXES_SHARE = 0.3  # of the largest held-out misfit that a second axis needs, to be searched at once
LAW_FITTED = 3  # sums that are fitted by output error,
LAW_FITTED_WITHIN = 3.0  # of so many times the best one's remainder
LAW_MOST_ROUNDS = 3  # laws that are added one after the other
LAW_SNAP = 0.003  # relative: so near a simple exponent, and so much more error, change nothing for a reader
LAW_BEATS = 0.5  # of a catalogue rival's excess that a law may leave at most
# of the missing force above the noise that a law may leave in the linear screen to be fitted before a second effect is
# looked for. Where a law was the whole truth, it left at most 0.01 (one of 11: 0.07); beside a second effect, 0.03 or
# more in 10 of 14 (laws of seed 642000, pairs of seed 99950)
LAW_ALONE_LEAVES = 0.05
LAW_STABLE = 0.2  # jackknife error of a factor over stretches, as a share; principle: five standard errors from none
LAW_PLACEBO = 0.5  # of what chance leaves of a shuffled force, that a law may leave of the missing one at most
LAW_SAME = 0.05  # of what a law predicts: laws that are no further apart are one, written in two ways
PITCHES_SEEN = 2.0  # of a periodic force, below which another curve may do as well; principle: a period is seen twice
LAW_COMMAND_TAKEN = 0.5  # of its axis's command, beyond which a force is the balance's trivial solution; by hand
LAW_NEAR = 0.03  # of a whole or half exponent, that is then rounded to it

# How a law of the command is distinguished from sums of laws of the motion (`balance/actuator`). By hand.
SUMS_BESIDE_COMMAND_LAW = 4  # best sums of laws of the motion that are tried beside a law of the command
# share of the error that the best sum of laws of the motion leaves which a law of the command must take: what lag
# and delay leave is smaller
COMMAND_LAW_LEAVES = 0.5
COMMAND_RIVAL_LEAVES_MORE = 0.3  # share of its own error by which a rival must leave more to be ruled out

# share of the samples, at least, in which an actuator of a tried limited rate reaches its command. By hand: one that
# never does goes by the command's sign alone
SLEW_REACHED = 0.25

# In which band forces are balanced, and on which samples (`band`, `balances`, `motion`, `blocks`). By hand.
# noise in the acceleration's mean square at most, as a share: about the relative bias of a mass
ACCELERATION_NOISE_SHARE = 0.01
BAND_WIDEST = 0.2  # the band's end at most, over the sample rate
BAND_NARROWEST_CYCLES = 20.0  # the band's end at least, in cycles per recording
SECOND_BAND_NARROWER = 0.5  # share of the band that noise allows, below which the band of the motion is another look
# share of the samples in which the device moves, below which these alone are another look
MOVES_MOST_OF_THE_TIME = 0.5
MOVING_BAND_SHARE = 0.99  # share of the speed's mean square below the end of the band in which the device moves
MOTION_OVERSAMPLED = 4.0  # samples that are kept per period of the band's end
# periods of the band's end that are left out at either end of a part: there the filter reaches beyond the data
MOTION_EDGE_PERIODS = 0.5
BALANCE_FOLDS = 8  # blocks of the samples to fit, and as many of those to test by, at least
# samples that parameters are fitted to at most, and as many to test by: the first ones of each block
BALANCE_MOST_SAMPLES = 20000

# Which sums of laws are tried, and which is the plainest (`structures`, `simplest_structure`, `linear_part`). By hand.
MOST_SUMMED_LAWS = 3
STRUCTURES_BEAM = 5  # structures of each size that are taken further
FURTHER_LAW_GAIN = 0.02  # share of the cross-validated error power that a further law must take
FURTHER_LAW_ERRORS = 2.0  # standard errors that the folds' mean gain, or their mean logarithmic gain, must exceed
# share of what the best structure takes of the linear model's error that a plainer one may leave to be preferred
PLAINER_LEAVES = 0.1
# share that further laws must take of the error that a plain structure leaves above that of all laws together,
FURTHER_LAW_OF_REST = 0.5
FURTHER_LAW_OF_ALL = 0.3  # and of all that it leaves
LINEAR_LAW_GAIN = 0.1  # share of the cross-validated error power that a delay or a linear law must take
MOST_LINEAR_LAWS = 4  # linear laws beside mass, damping and stiffness
LINEAR_PART_ROUNDS = 2  # searches at most, each with the linear part that the one before it found

# Which laws of a balance are named (`judge_laws`, `judged_law`). By hand.
# share of what all laws together take of the error that the named ones must reach, so that they are its main part
NAMED_OF_CEILING = 0.5
LAW_OF_CEILING = 0.05  # share of the same that each named law must take
RIVAL_STAYS_BEHIND = 0.15  # share of a law's gain by which a rival in its place must stay behind to be ruled out
# share of the force's rms that a law must take: laboratory recordings are not calibrated better
LAW_OF_SIGNAL = 0.02
SECOND_OF_FAMILY = 2 / 3  # share of what is left that a second law of one family must take
LARGEST_CLASS = 4  # effects of a class at most; a larger class says nothing, unless all of it is dry friction
LEAST_JUDGED_BLOCKS = 4
# standard deviation of a law's own force at most, over the recorded one's: more is cancelled by other columns
LARGEST_LAW_FORCE = 2.0
BOOTSTRAP_DRAWS, BOOTSTRAP_SEED = 2000, 1  # resampled blocks of an interval
BOOTSTRAP_LEVEL = 0.025  # quantile that is its lower end

# What a simulation must bear out of what a balance named (`confirm`). By hand.
# times the held-out error without new physics that the completed model may leave at most
CONFIRMED_LEAVES = 0.9
# times the error that a constant may leave at most to be worth saying; principle: as a named law, `confirm_laws`
CONSTANT_LEAVES = 0.9
HELD_OUT_STRETCHES = 16  # number of stretches of all held-out samples, about
LEAST_HELD_OUT_STRETCHES = 4
AT_RETUNING_BOUND = 0.97  # share of a re-tuned number's bound, from which on it counts as at the bound
CANDIDATES_WITH_GAIN = 3  # fitted candidates of the last round that are reported with their gain

# What a first model is made of (`first_model`). By hand.
MODES_GAIN = 0.1  # share of the held-out error in a free simulation that modes must take
REMAINDER_REPORTED = 0.1  # share of the remaining power from which on its dependence on a signal is reported
# share of the measured response's spread that a fitted model must show. By hand: models with masses without bound
# show 1e-30 of it, poor ones a tenth
LEAST_MODEL_ANSWER = 0.001
DECAY_LEAST_CYCLES = 4  # cycles of a stretch of a decay that is fitted to or tested by
DECAY_MOST_LEVELS = 6  # stretches of one decay
# test blocks at least; with fewer, or where nothing moves in them, the held-out error is that of cross-validation
# on the fit blocks
LEAST_TEST_BLOCKS = 3
FOUND_NUMBERS_OPEN = 0.1  # standard deviation of the parameters found at least, relative
RICHER_STRUCTURE_GAIN = 0.02  # share of the plainer structure's error power that a richer one must take
RICHER_STRUCTURE_ERRORS = 2.0  # standard errors over the folds that the gain must exceed
# singular values of standardised commands and motions, over the largest, below which they are rounding: a
# thousandth, by hand
DEPENDENT_SIGNALS = 0.001
UNSIGNED_BELOW_ZERO = 0.05  # negative values of such a speed by noise at most, over its rms
PUSHED_BOTH_WAYS = 0.1  # share of the command's power that must push either way
REVERSAL_NEAR_ZERO = 0.25  # speed over its rms below which a minimum may be a reversal
SIGNED_SPEED_FITS = 0.5  # share of the signed speed's power that the filter must predict,
SIGNED_SPEED_BETTER = 0.5  # and its error over that for the magnitude, at most
# share of the folds' error power that the turned sign must take; as much as a linear law must
REVERSED_SIGN_GAIN = 0.1
# share of the held-out force power that a derivative of the response must explain to be of use
DERIVATIVE_NEEDED = 0.02

# What both sets are compared by (`bases`, `force_base`, `autoregressive_base`, `sensor_base`, `part`). By hand.
BALANCE_HOLDS = 0.35  # share of the force's rms that a force balance may leave unexplained to be used
CONSTANT_SIGNAL = 0.0001  # standard deviation of a signal over its rms below which it counts as constant
# ratio of the motions of both sets above which they are not compared: a recording of motion does not predict what
# a device does at rest. By hand: no sensor fault that can be undone makes as much
MOTIONS_APART = 20.0
AUTOREGRESSIVE_ORDER = 24  # order of the autoregressive model
MOST_BASE_LAWS = 10
BASE_LAW_GAIN = 0.01  # share of the folds' error that a further law must take
RESPONSE_BAND_SHARE = 0.999  # share of the response's power below the band's end
RESPONSE_OVERSAMPLED = 3.0  # decimated rate over twice the frequency of the band's end, at least
SENSOR_TAPS = 2  # samples before and after that predict a reading: filters of the two sensors differ by so much
PART_LEAST_SAMPLES = 64  # samples of a part at least
# samples of a recording that are used at most, its last: enough to find a fault that matters, in bounded time
PART_MOST_SAMPLES = 40000
# blocks of each set: a fault that acts in a small part of a recording, such as a stop that is hit twice, must be
# in several of them, or most resampled blocks would lack it
CONTRAST_BLOCKS = 24
CONTRAST_WHITENING_ORDER = 8  # order of the autoregressive model that whitens the errors

# What sets two recordings apart (`compare`). By hand.
# times the largest excess between stretches of one set that both together must have. By hand: of seven public
# devices in order, halves of which a fault was named had up to 1.53 times; faults that were named right, 1.75 and
# more
SETS_APART = 1.6
# excess of the error of both sets together over that of each by itself, up to which they are of one device
SETS_AS_ONE = 0.05
# share of the error power of both sets that a fault must gain: a fault that adds a tenth to the error power of
# one set gains that much. Smaller ones are not worth a name
LEAST_FAULT_GAIN = 0.05
SIZE_IS_NEAR = 0.02  # distance from size 1 within which it is not
# times at most that a fault whose undoing is not linear is undone anew about the size that was found
UNDOING_ROUNDS = 4

# Which faults are named (`decide`). By hand.
# times the largest gain between stretches of one set that a fault must gain. By hand: of six public devices in
# order, two halves differed by up to 3.7 times
FAULT_BEYOND = 5.0
# share of a gain that its lower end must be where the sets differ no more than stretches of one do. By hand: 0.16
# to 0.37 where two halves in order had another delay by chance; 0.47 for a damper that is hardly seen
FAULT_STEADY = 0.4
# share of what sets the sets apart that a name must explain: with less, the main part is another's
FAULT_MAIN_PART = 0.4
FAULT_RIVAL_BEHIND = 0.1  # share of a fault's gain by which a rival must stay behind to be ruled out,
# or of what the fault leaves: where a gain is large, a tenth of it is many times that. By hand
FAULT_RIVAL_WORSE = 0.25
LARGEST_FAULT_CLASS = 4  # faults of a class at most; a larger class says nothing

# Faults of signals (`signal_faults`, `sensor_faults`, `actuator_faults`). By hand, but where a principle is named.
MAINS_HZ = (50.0, 60.0)
MAINS_OFF_HZ = 0.5  # deviation of the mains frequency, or of a logger's clock, at most
LINE_STANDS_OUT = 30.0  # power of a line over the median of its neighbourhood: noise exceeds it in one of e^30 lines
LINE_IS_NEW = 6.0  # times as far as on the clean recordings, and as in the command, that it must stand out
# times the largest noise of any clean stretch that the smallest of the faulty ones must have: what changes with
# the motion is no noise of a sensor
NOISE_LOUDER = 4.0
NOISE_EVEN = 1.6  # ratio of the powers of white noise in two bands at most
NOISE_STRETCHES = 6
REVERSAL_OF_GAP = 0.05  # share of a gap by which a reading must go back to count as a reversal
CLOCK_FASTEST = 0.05  # relative rate error of a clock at most
LATE_STEP = 0.25  # rows from one delay to the next that are tried about that of a cross-correlation
LONGEST_DELAY = 0.3  # largest delay, over the period of the command's median frequency
