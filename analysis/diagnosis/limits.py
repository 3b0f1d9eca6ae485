"""The main limits by which the diagnosis decides, in one table: of the search by simulation, then of the force balance
and first models, then of the comparison with clean recordings. Imported by the modules of `analysis.diagnosis`, of
which each section's heading names the main ones, and by those that report limits.

Grids of starting values, numerical tolerances and limits within one step are defined in the files that use them.

Unless a comment says otherwise, an error is an rms error over the rms noise (1 = noise alone), in the worst channel,
and a gain is the difference of the mean log error power between two fits (`FitScore.mean_log_error`).

Sources of the values:

* principle: the value follows from the sentence next to it;
* a name and a year: from the literature;
* bank: the value was set from the results of a bank of simulated devices (docs/proof_history.md), given by its first
  seed;
* hand: the value was set by hand during development, on simulated devices that are not in any reported bank
  (docs/proof_history.md); for the force balance on five public recordings and simulated axes, for the comparison with
  clean recordings on devices without a fault, by comparing two halves of a recording (docs/real.md).
"""

from math import log

# Least requirements on recordings and models (`input_checks`). By hand.
LEAST_SAMPLES = 256  # samples with a response, all recordings together: fewer allow neither a fit nor a test
# length in s, and in samples: recordings below both limits are explained equally well by any effect
SHORTEST_S, SHORTEST_SAMPLES = 1.5, 2000
LEAST_SAMPLES_TO_FIT = 64  # samples with a response that are available for fitting
# cycles, all recordings together, of the frequency below which `CYCLES_SHARE` of the commands' power lies
LEAST_CYCLES = 3.0
# share of the commands' power; by hand: 0.81 of the power of a step, which is no cycle, lies in one spectral line
CYCLES_SHARE = 0.75
BRIDGED_GAP_ERROR = 0.02  # share of the command's spread: largest error of linear interpolation over a gap; by hand
# least share of the samples without gaps that lies in stretches that can be compared; principle: the main part
LEAST_GAPLESS_SHARE = 0.5
LARGEST_VALUE = 1e12  # SI; principle: far beyond any device, and its powers are still finite numbers
# e-foldings of the free motion over the longest recording; principle: rounding errors stay far below it
MOST_GROWTH = 1.0
# standard deviations by which coherence must exceed that of noise alone for the device to respond
DRIVEN_DEVIATIONS = 5.0
# coherence (0 to 1) of a device that clearly responds; where even this would exceed the coherence of noise by less than
# twice `DRIVEN_DEVIATIONS`, the recordings are too short for a judgement
DRIVEN_COHERENCE = 0.5

# How samples are split, and how well a model is trusted (`observed`). By hand.
MODEL_FLOOR = 0.002  # share of a channel's rms that counts as noise; principle: no model is exact
LEVELS_TO_STRATIFY = 2  # levels from which each is split; principle: the end of a recording may hold a single level
# levels from which one is held back to choose by; principle: it lies between two levels that are fitted
LEVELS_TO_HOLD_ONE_BACK = 3
CHOOSE_SHARE = 0.25  # share of the fitting time, from its end, to choose by where no level can be held back for that
TEST_SHARE = 0.25  # share of the time, or of each part's motion, from its end, to test by where no segment has a role
REST_RANGE_SHARE = 0.02  # share of a response's range within which it counts as at rest at the end of a part
LONGEST_TAIL_SHARE = 0.05  # share of a part: longest rest at its end that needs no other split and gives the rest value
STILL_SHARE = 0.01  # share of the mean square of the fitted motion, below which motion is rest and tests nothing

# Which error measure suits (`error_measure_rule`, `closed_loop`). By hand.
FED_BACK_SHARE = 0.1  # share of the command's rms by which it must differ from the recorded excitation in a closed loop
# closed loop: responses reduce a command's prediction error from its own past to this share (Granger 1969)
PREDICTED_SHARE = 0.05
# share of the longest record, below which the slowest time constant of a plant lets its free motion decay in it
LONGEST_DECAY_SHARE = 1 / 3
SETTLED_CONSTANTS = 5.0  # time constants after which a motion has decayed; principle: exp(-5) is below 1 %
MOST_OMITTED_SHARE = 0.25  # largest share of a recording that may be left out until an initial motion has decayed
REST_SHARE = 0.5  # share of a channel's rms, and of the rms of its changes, above which its start is not at rest
REST_S = 0.02  # s: duration at the start of a record over which rest is judged; principle: an offset is no motion
# share of each named law's power that a band must contain for forces to be compared in that band only
LAW_BAND_POWER_SHARE = 0.95
UNKNOWN_NOISE_SHARE = 1e-3  # share of the signal that counts as noise where a recording gives no estimate

# How far the model's own parameters may move (`tuning`, `output_error`, `rigid_model`). By hand.
RETUNING_BOUND = 4.0  # standard deviations of the calibration
# the same for the repeated search, where a mismatch remains (`repeat_with_wider_bound`). Bank 101700, pairs
WIDER_RETUNING_BOUND = 12.0
UNSTATED_SHARE = 0.1  # standard deviation without a stated tolerance, relative to the largest parameter at any axis
UNSTATED_MODE_SHARE = 0.02  # relative standard deviation of a mode's frequency without a stated tolerance
# relative standard deviation of damping and stiffness, and of mass, of a fitted rigid model
RIGID_SHARE, RIGID_MASS_SHARE = 0.25, 0.05
# inertial force of a body that shows none, relative to the force's rms; principle: far below any error
MASSLESS_SHARE = 1e-3
SPRING_SHARE = 0.05  # share of the misfit that springs must remove to be part of a fitted rigid model
RETUNING_NAMED, RETUNING_DOUBTED = 1.0, 3.0  # standard deviations from which a moved parameter is listed, and doubted

# Localisation of a mismatch (`mismatch_cells`, `level_trends`, `entry_point`, `find_state_dependences`). By hand.
FALSE_DISCOVERY_RATE = 0.01  # of cells and states, by the test of Benjamini and Bogomolov (2014)
DISTORTION_P = 0.001  # p-value below which a kind of distortion is significant
STEADY_DB = 1.5  # dB per doubling of the level, within which a distortion neither rises nor falls
ENTRY_DIRECTION_SINE = 0.1  # mean sine between two entries' directions below which they are not distinguished
ENTRY_LINE_POWER_RATIO = 3.0  # least ratio of residual to noise, in power, of a spectral line that counts
# score that each further direction must gain; otherwise model errors on other axes would appear as forces
ENTRY_PER_DIMENSION = 0.25
ENTRY_SENSOR_PENALTY = log(2.0)  # score against an entry that contradicts the comparison of position and response
ENTRY_LEAST_LINES = 40  # lines above the noise, below which no statement is made on where a mismatch enters
ENTRY_RIVAL_P = 0.05  # p-value above which the next-best entry explains the mismatch about as well
# least ratio, in power, of the position change that the response's residual implies to the position's noise
SENSOR_CHANGE_POWER_RATIO = 4.0
SENSOR_LINE_POWER_RATIO = 10.0  # least ratio, in power, of the response's residual to its own noise on such a line
SENSOR_LEAST_LINES = 5  # least number of such lines
# share of the implied position change: below the first the position lacks the change, above the second it contains it
SENSOR_ABSENT_SHARE, SENSOR_PRESENT_SHARE = 0.1, 0.5
STATE_CONCENTRATION = 1.5  # least ratio of a region's share of the mismatch to its share of the samples
MOST_NAMED_STATES = 2  # per axis or channel; principle: a dependence on one state also appears in others

# Which hypotheses are tried and fitted (`starting_hypotheses`, `screening`, `search_context`). By hand.
STARTS_PER_CLAIM = 4  # most starting values of an effect at a site
WEAKEST_START, STRONGEST_START = 0.1, 6.0  # factors by which the strength of a starting value may be wrong
MOST_FITTED, LEAST_FITTED = 10, 4  # largest and least number of hypotheses that get a first fit
FITTING_GAIN_SHARE = 0.2  # share of the best predicted gain that a hypothesis must reach to be fitted
MOST_REFINED = 3  # most fits that are continued until convergence
REFINING_GAIN_SHARE = 0.5  # share of the best fit's gain that a fit must have reached to be continued
# share of the cost by which the predictions of two fits of one law may differ to count as the same
SAME_FIT_COST_SHARE = 0.01
# share of an effect's gain by which the predictions of two laws may differ to share a sensitivity
SHARED_SENSITIVITY_SHARE = 0.05
SECOND_START_ERROR = 1.08  # error above which a fit is repeated from a second starting point
# error up to which a fit is continued after three steps, if the best is at the noise, and no pair is searched for
NEAR_NOISE_ERROR = 2.0
# noise variances, in sum, that a law with more parameters must gain over one of similar effect
RICHER_LAW_SQUARES = 4.0
# trials of the delay at the recording's end per middle period of the response, and most in either direction
CLOCK_TRIALS_PER_PERIOD, MOST_CLOCK_TRIALS = 6, 120
CLOCK_LEAST_SHARE = 1e-3  # share of the misfit that a trial of clock drift must remove

# Part of a periodic recording on which hypotheses are compared first (`short_recordings`).
RUN_IN_CONSTANTS = 7.0  # time constants of the model's run-in; principle: exp(-7) is below a thousandth
RUN_IN_ERROR = 0.1  # largest error power by a run-in that is too short, relative to the cost; by hand
SHORT_SHARE = 0.7  # share of kept samples above which the whole recording is simulated at once; by hand

# Whether a further effect is looked for, and added (`explain`). By hand.
MOST_EFFECTS = 3  # effects in one explanation
NOISE_ALONE = 1.05  # error that counts as noise alone
HELD_OUT_MISMATCH_ERROR = 1.15  # held-out error of the re-tuned model, from which an effect is searched for in any case
ADDED_SHARE = 0.15  # share of the error above the noise that an effect must remove to be added
ADDED_GAIN = 0.003  # least gain of an effect to be added

# Which of several explanations is preferred (`parsimony`). By hand.
NOISE_ACCURACY = 0.01  # gain that counts as none; principle: noise is not known more accurately
# gain below which explanations are equally good: a hundred times chance in a minute of six channels
AS_GOOD_GAIN = 0.0015
AS_GOOD_SHARE = 0.1  # the same limit as a share of the error that the better one leaves above the noise
REFINED_GAIN = 0.006  # gain that a refined law must have over the plain law that it contains
# the same as a share of the error that the plain law leaves: of two wrong laws, the richer one has the smaller error
REFINED_SHARE = 0.35
# the same share for dry friction: reversals differ between devices, and any parameter fits a part of that
REFINED_FRICTION_SHARE = 0.7
REFINED_MOST_GAIN = 0.7  # largest gain so required; principle: ln 2, half of the error power, outweighs simplicity

# When a found effect is removed again (`prune`, `identifiability`, `no_prediction`).
# share of the mismatch that the last effect must remove. Bank 93000: four of five effects below it were wrong; right
# ones removed a fifth or more
LAST_EFFECT_SHARE = 0.1
# probability of re-tuned parameters so far from the calibration, below which a small error is not trusted; principle
IMPROBABLE_DEVIATIONS = 0.01
# difference of information criteria above which the worse model has essentially no support: Burnham and Anderson, Model
# Selection and Multimodel Inference, 2002, ch. 2.6
DECISIVE_CRITERION = 10.0
# half width of the interval over the distance from zero effect, above which no profile is computed. Bank 93000:
# effects with a ratio of 6 or more were wrong
UNDETERMINED_REACH = 5.0
REPLACEMENTS_TRIED = 2  # most rivals that are tried in place of an undetermined effect; by hand
NO_PREDICTION_SHARE = 0.9  # residual over signal, in rms, from which an explanation predicts nothing; by hand
NO_PREDICTION_ERROR = 3.0  # error from which a single effect is judged by `NO_PREDICTION_SHARE`; by hand

# The verdict (`verdict`, `parsimony`, `search_context`). By hand, except where a bank is named.
# error up to which an explanation is as good as noise; principle: laws of real physics are never exact
EXPLAINED_ERROR = 1.12
# share of the mismatch, with which an explanation is also as good as noise up to the second number, an error: real
# friction reverses more smoothly
CONVINCING_SHARE, CONVINCING_ERROR = 0.93, 1.3
# largest held-out error of a complete explanation. Bank 93000: 169 of 172 right explanations below, three of nine wrong
# ones above
HELD_OUT_ERROR = 1.5
NAMED_ERROR = 3.0  # error up to which effects are named although a mismatch remains
NAMED_SHARE = 0.9  # share of the mismatch that effects must remove to be named above `NAMED_ERROR`
NAMED_GAIN = 1.6  # or gain, four fifths of the error power, with which they are named too: noise may be very small
# error over chance variation, where band powers are compared; principle: no contact law is exact
EXPLAINED_BY_CHANCE = 2.5
CONFIRMED_SHARE = 0.3  # share of the mean log error on held-out samples that effects must remove
HELD_OUT_TOO_SMALL = 0.05  # mean log error on held-out samples up to which they need no confirmation
# factor by which the held-out error must exceed the noise, and the error on the other samples, for a part of the
# held-out samples to be used for fitting (`open_quieter_segments`). Banks 101000 and 101200, pairs
HELD_OUT_ALONE_ERROR = 1.25
LEAST_PART_SAMPLES = 16  # samples: shortest part into which held-out stretches are cut
LOUDER_RATIO = 1.05  # ratio to the largest command elsewhere, from which a stretch counts as louder

# Faults that a recording shows without a model (`model_free_faults`). By hand.
STEP_FACTOR = 1.5  # ratio to a reference device's steps, from which steps are different
READINGS_LEAST = 8  # least number of readings at a limit, or of repeated readings, of a fault
READINGS_FACTOR = 3.0  # least ratio of their number to that of a device without a fault
READINGS_DEVIATIONS = 5.0  # standard deviations of such a count by which their number must exceed that of this device
LARGEST_LEARNED_SHARE = 0.3  # largest learned model error of a fault-free device, relative to the signal

# Rattling play (`impacts`). By hand.
IRREGULAR_ERROR = 3.0  # rms variation between periods, over the noise, from which a response is irregular
PEAKED_KURTOSIS = 10.0  # kurtosis of the residual from which it is irregular, where no period repeats; Gaussian: 3
IMPACTS_LEAST_SPREAD = 0.05  # least rms logarithm of amplitude by chance; principle: no simulation predicts it better
# share of the linear model's misfit to be removed, and largest misfit left over chance
IMPACTS_SHARE, IMPACTS_ERROR = 0.6, 3.0
IMPACTS_RIVAL_RATIO = 1.1  # ratio to the misfit of the named effect, up to which a rival is as good

# Numbers and probabilities of what is named (`named_effects`).
MOST_RIVALS = 6  # most rivals that are reported per effect; by hand
# widens intervals by noise alone, which held 65 % (bank 91000); least half width, relative to the value
INTERVAL_FACTOR, INTERVAL_SHARE = 2.5, 0.005
INTERVAL_HALF_WIDTH = 1.96 * INTERVAL_FACTOR  # half width of such a 95 % interval, in standard errors
# limit of the jackknife error over segments, in standard errors by noise. Bank 99700 (docs/proof_history.md)
MOST_BETWEEN_SEGMENTS = 5.0
# difference of gain that makes a candidate e times less likely. Bank (docs/proof_history.md), as the next three
PROBABILITY_SCALE = 0.002
# probability that no candidate is right: with noise alone left, and with much more left
NO_CANDIDATE_LEAST, NO_CANDIDATE_MOST = 0.01, 0.8
# error above the noise halfway between these, and the share of the re-tuned model's excess rms error that counts as
# much (bank 104100); steepness of the transition
NO_CANDIDATE_HALFWAY, NO_CANDIDATE_HALFWAY_SHARE, NO_CANDIDATE_STEEPNESS = 0.35, 0.07, 1.5

# Limits of statements and proposals (`wording`, `unit_doubt`, `next_experiment`). By hand.
EQUAL_ERROR_RATIO = 1.05  # ratio of errors up to which they count as the same
CONFIRMED_FIT_RATIO = 1.25  # largest ratio of the held-out error to the error on the fitted samples
# factor from which a unit is doubted, and least correlation of the signals for that
UNIT_FACTOR, UNIT_CORRELATION = 5.0, 0.9
DISCRIMINATING_GAIN = 10.0  # log likelihood, below which a proposed recording would not discriminate rivals

# Laws outside the catalogue (`discovery`). By hand, except where a principle is named.
LAW_BLOCKS = 6  # least number of stretches over which held-out errors are computed
LAW_POWER_KEPT = 0.999  # share of the commands' power within the band in which laws are ranked
LAW_STARTS_REFINED, LAW_BEAM = 6, 4  # starts whose free parameters are fitted; sums that are kept (beam search)
LAW_MOST_TERMS = 2  # terms along one axis in one sum; more are added in further rounds
LAW_REMAINDER_SHARE = 0.3  # share of the misfit that one term may leave; with more, a sum is searched for
LAW_NOISE_POWER = 1.1  # held-out error power along an axis, 1 = noise, below which no law is searched for
LAW_WORTH_SHARE = 0.4  # share of the error left above the noise that a further term must remove
LAW_AXES_SHARE = 0.3  # share of the largest held-out misfit that a second axis needs to be searched in the same round
MOST_FITTED_SUMS = 3  # most sums that are fitted by output error, without a rival of other variables
FITTED_SUM_ERROR_RATIO = 3.0  # largest ratio of the excess error of a fitted sum to that of the best one
LAW_MOST_ROUNDS = 3  # most laws that are added one after the other
# relative distance from a simple exponent, and relative increase of the cost, up to which a law is rounded
LAW_ROUNDING_TOLERANCE = 0.003
LAW_REPLACES_RATIO = 0.5  # largest excess error of a law relative to a catalogue effect's, for the law to replace it
# largest share of the missing force above the noise that a law may leave in the linear screen to be fitted before a
# second effect is searched for. A law that was the only missing effect left at most 0.01 (one of 11: 0.07); with a
# second effect it left 0.03 or more in 10 of 14 (laws of seed 642000, pairs of seed 99950)
LAW_ALONE_REMAINDER = 0.05
LAW_FACTOR_ERROR = 0.2  # largest relative jackknife error of a law's factor; principle: five standard errors from zero
# largest share of the missing force that a law may leave, relative to the share that laws leave of a shuffled force
SHUFFLED_RATIO = 0.5
SAME_LAW_SHARE = 0.05  # share of a law's force by which two laws may differ to count as one law in two forms
# periods of a periodic force in the motion, below which another curve may fit; principle: a period must repeat
LEAST_PITCH_PERIODS = 2.0
# share of its axis's command, above which a law is the trivial solution of the balance; by hand
LAW_COMMAND_SHARE = 0.5
LAW_EXPONENT_TOLERANCE = 0.03  # distance from a whole or half exponent within which it is rounded to that

# How a law of the command is distinguished from sums of laws of the motion (`balance/actuator`). By hand.
SUMS_BESIDE_COMMAND_LAW = 4  # best sums of laws of the motion that are tried together with a law of the command
# share of the error of the best sum of laws of the motion that a law of the command must remove: errors by lag and
# delay are smaller
COMMAND_LAW_GAIN = 0.5
COMMAND_RIVAL_MARGIN = 0.3  # share of a rival's error by which it must exceed the law's error to be ruled out

# least share of the samples in which an actuator with a tried slew rate reaches its command. By hand: an actuator that
# never reaches it depends on the sign of the command alone
SLEW_REACHED_SHARE = 0.25

# In which band forces are balanced, and on which samples (`band`, `balances`, `motion`, `blocks`). By hand.
# largest share of the noise in the mean square of the acceleration: about the relative bias of an estimated mass
ACCELERATION_NOISE_SHARE = 0.01
HIGHEST_BAND_END_RATIO = 0.2  # largest upper end of the band, relative to the sample rate
# mean square of the difference of two sensors of a point up to which they are fused, relative to their noise
LARGEST_SENSOR_DISAGREEMENT = 2.0
LEAST_BAND_END_CYCLES = 20.0  # least upper end of the band, in cycles per recording
SECOND_BAND_SHARE = 0.5  # share of the noise-limited band, below which the motion's band is balanced as well
# share of the samples in which the device moves, below which a second balance uses only these samples
MOVING_TIME_SHARE = 0.5
MOVING_BAND_SHARE = 0.99  # share of the speed's mean square below the upper end of the band in which the device moves
MOTION_OVERSAMPLED = 4.0  # samples kept per period of the band's upper end
# periods of the band's lower end, or of its upper end where there is no lower one, that are left out at both ends of a
# part, where the filter reaches beyond the data
MOTION_EDGE_PERIODS = 0.5
BALANCE_FOLDS = 8  # least number of blocks to fit, and of blocks to test by
# largest number of samples to fit to, and of samples to test by: the first ones of each block
BALANCE_MOST_SAMPLES = 20000

# Which sums of laws are tried and preferred (`structures`, `choose_simplest_structure`, `linear_part`). By hand.
MOST_SUMMED_LAWS = 3  # laws in one sum
STRUCTURES_BEAM = 5  # structures of each size that are extended further
FURTHER_LAW_GAIN = 0.02  # share of the cross-validated error power that a further law must remove
FURTHER_LAW_ERRORS = 2.0  # standard errors that the folds' mean gain, or their mean logarithmic gain, must exceed
# share of the best structure's error reduction, relative to the linear model, that a simpler structure may miss
SIMPLER_SHORTFALL = 0.1
# share that further laws must remove of the error that a structure leaves above that of all laws together
FURTHER_LAW_EXCESS = 0.5
FURTHER_LAW_SHARE = 0.3  # share that further laws must remove of the whole error that a structure leaves
LINEAR_LAW_GAIN = 0.1  # share of the cross-validated error power that a delay or a linear law must remove
MOST_LINEAR_LAWS = 4  # linear laws in addition to mass, damping and stiffness
LINEAR_PART_ROUNDS = 2  # most searches, each with the linear part that the previous one found

# Which laws of a balance are named (`judge_laws`, `judged_law`). By hand.
# share of the error reduction by all laws together that the named laws must reach: then they are its main part
NAMED_REDUCTION_SHARE = 0.5
LAW_REDUCTION_SHARE = 0.05  # share of that reduction which each named law must reach
RIVAL_MARGIN = 0.15  # share of a law's gain by which a rival in its place must be worse to be ruled out
# share of the force's rms that a law must take: laboratory recordings are not calibrated better
LAW_FORCE_SHARE = 0.02
# share of the squared held-out error that a law outside the catalogue must remove: it halves the error
FREE_LAW_GAIN = 0.75
SECOND_OF_FAMILY_SHARE = 2 / 3  # share of the remaining error that a second law of one family must remove
LARGEST_CLASS = 4  # most effects in a class that is named, unless all of them are dry friction
LEAST_JUDGED_BLOCKS = 4  # least number of test blocks by which laws are judged
# largest standard deviation of a law's own force, relative to that of the recorded force: a larger one is cancelled by
# other columns of the regression
LARGEST_LAW_FORCE = 2.0
BOOTSTRAP_DRAWS, BOOTSTRAP_SEED = 2000, 1  # number of draws of resampled blocks for an interval, and their seed
BOOTSTRAP_LEVEL = 0.025  # quantile that is an interval's lower end

# How a simulation must confirm the laws that a balance named (`confirm`). By hand.
# largest held-out error of the completed model, relative to the held-out error without new physics
CONFIRMED_RATIO = 0.9
# largest error with a constant force that is worth reporting, relative to the error without it; principle: the same as
# for a named law, `confirm_laws`
CONSTANT_ERROR_RATIO = 0.9
HELD_OUT_STRETCHES = 16  # about the number of stretches into which all held-out samples are divided
LEAST_HELD_OUT_STRETCHES = 4  # stretches, below which no held-out gain is computed
AT_RETUNING_BOUND = 0.97  # share of its bound from which a re-tuned parameter counts as at the bound
CANDIDATES_WITH_GAIN = 3  # fitted candidates of the last round that are reported with their gain

# How a first model is built (`first_model`). By hand.
MODES_GAIN = 0.1  # share of the held-out error of a free simulation that modes must remove
REPORTED_REMAINDER_SHARE = 0.1  # share of the remaining power, from which its dependence on a signal is reported
# least standard deviation of a fitted model's response, relative to the measured one. By hand: models whose masses grew
# without bound show 1e-30 of it, poor models a tenth
LEAST_MODEL_RESPONSE = 0.001
DECAY_LEAST_CYCLES = 4  # least cycles in a stretch of a decay that is fitted or tested
DECAY_MOST_LEVELS = 6  # most stretches of one decay
# least number of test blocks; with fewer, or where nothing moves in them, the held-out error is that of
# cross-validation on the fit blocks
LEAST_TEST_BLOCKS = 3
FOUND_PARAMETER_DEVIATION = 0.1  # least standard deviation of the parameters found, relative to the largest entry
RICHER_STRUCTURE_GAIN = 0.02  # share of the plainer structure's error power that a richer one must remove
RICHER_STRUCTURE_ERRORS = 2.0  # standard errors over the folds that the gain must exceed
# ratio to the largest singular value of the standardised commands and motions below which a singular value counts as
# rounding
SINGULAR_VALUE_RATIO = 0.001
UNSIGNED_NEGATIVE_SHARE = 0.05  # largest negative value, by noise, of a speed without sign, over its rms
LEAST_SIGN_SHARE = 0.1  # share of the command's power that each sign of the command must have
REVERSAL_SPEED_SHARE = 0.25  # speed over its rms, below which a minimum may be a reversal
SIGNED_SPEED_FIT_SHARE = 0.5  # least share of the signed speed's power that the filter predicts
SIGNED_SPEED_ERROR_RATIO = 0.5  # largest ratio of the filter's error for the signed speed to that for its magnitude
# share of the folds' error power that reversing the sign must take; the same as for a linear law
REVERSED_SIGN_GAIN = 0.1
# share of the held-out force power that a derivative of the response must explain to be of use
DERIVATIVE_GAIN = 0.02

# Reference predictions by which both sets are compared (`bases`, `force_base`, `autoregressive_base`, `sensor_base`,
# `recording_part`). By hand.
MISFIT_SHARE = 0.35  # largest share of the force's rms that a usable force balance leaves unexplained
CONSTANT_SIGNAL = 0.0001  # standard deviation of a signal over its rms below which it counts as constant
# ratio of the motions of both sets above which they are not compared: a recording of motion does not predict a device
# at rest. By hand: no invertible sensor fault causes such a ratio
MOST_MOTION_RATIO = 20.0
AUTOREGRESSIVE_ORDER = 24  # order of the autoregressive model
MOST_BASE_LAWS = 10  # most laws in the force balance of a set
BASE_LAW_GAIN = 0.01  # share of the folds' error that a further law must remove
RESPONSE_BAND_SHARE = 0.999  # share of the response's power below the upper end of the band
RESPONSE_OVERSAMPLED = 3.0  # least ratio of the decimated rate to twice the band's upper end
SENSOR_TAPS = 2  # samples before and after that predict a reading: the filters of two sensors differ by so much
PART_LEAST_SAMPLES = 64  # least number of samples of a part
# largest number of samples of a recording that are used, the last ones: enough to find a relevant fault in bounded time
PART_MOST_SAMPLES = 40000
# blocks of each set: a fault that acts in a small part of a recording, such as an end stop that is hit twice, must be
# in several blocks, else most resampled sets would lack it
CONTRAST_BLOCKS = 24
CONTRAST_WHITENING_ORDER = 8  # order of the autoregressive model that whitens the errors

# When two sets of recordings differ (`rank_faults`). By hand.
# factor by which the excess error of both sets together must exceed the largest excess between stretches of one set.
# By hand: of seven public devices without a fault, halves in which a fault was named reached a factor of 1.53; for
# correctly named faults it was 1.75 or more
SETS_EXCESS_FACTOR = 1.6
# excess of the error of both sets together over that of each set alone, up to which both are from the same device
SAME_DEVICE_EXCESS = 0.05
# least share of the error power of both sets that a fault must explain: as much as a fault explains that adds a tenth
# to the error power of one set. Smaller faults are not named
LEAST_FAULT_GAIN = 0.05
FAULT_SIZE_TOLERANCE = 0.02  # relative change of a fault's size, below which its inversion is not repeated
# largest number of rounds in which a fault with a nonlinear inverse is inverted again at the size found before
INVERSION_ROUNDS = 4

# Which faults are named (`contrast.choose_fault`). By hand.
# factor by which the gain of a fault must exceed the largest gain between stretches of one set. By hand: for six public
# devices without a fault, the factor between two halves was up to 3.7
FAULT_GAIN_FACTOR = 5.0
# least ratio of the lower end of a gain's interval to the gain, where the sets differ no more than stretches of one
# set. By hand: 0.16 to 0.37 for two halves without a fault whose delays differed by chance; 0.47 for a barely visible
# damper
FAULT_INTERVAL_RATIO = 0.4
# least share of the difference between the sets that a named fault must explain: with less, another cause is the main
# part
LEAST_FAULT_SHARE = 0.4
# A rival is ruled out where it is worse by the smaller of two margins: a share of the fault's gain, and a share of the
# error that the fault leaves (where a gain is large, a tenth of it is many times that error).
FAULT_RIVAL_GAIN_MARGIN = 0.1
FAULT_RIVAL_ERROR_MARGIN = 0.25
LARGEST_FAULT_CLASS = 4  # most faults of a class that is named; a larger class is not informative

# Faults of signals (`signal_faults`, `sensor_faults`, `actuator_faults`). By hand, except where a principle is named.
MAINS_HZ = (50.0, 60.0)  # Hz: frequencies of power grids
MAINS_TOLERANCE_HZ = 0.5  # Hz: largest deviation of the mains frequency, or of its reading by a logger's clock
# power of a line over the median of its neighbourhood: white noise exceeds it in one of 2^30 lines
LINE_PROMINENCE = 30.0
NEW_LINE_RATIO = 6.0  # least ratio to its prominence on the clean recordings, and to that in the command
# least ratio of the smallest noise of any faulty stretch to the largest of any clean stretch: noise that changes with
# the motion is no sensor noise
NOISE_INCREASE = 4.0
NOISE_BAND_RATIO = 1.6  # largest ratio of the powers of white noise in two bands
NOISE_STRETCHES = 6  # about the number of stretches of a part in which the noise is compared
REVERSAL_SHARE = 0.05  # share of a gap by which a reading must go back to count as a reversal
LARGEST_CLOCK_ERROR = 0.05  # largest relative rate error of a clock
DELAY_STEP = 0.25  # rows between the delays that are tried around the delay of a cross-correlation
LONGEST_DELAY_PERIODS = 0.3  # largest delay, over the period of the command's median frequency
