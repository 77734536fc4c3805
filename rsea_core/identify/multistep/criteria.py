"""Numbers by which the multistep search decides; gains are tempered log-likelihood units."""

HORIZONS = (0.1, 0.3, 1.0, 4.0, 16.0, None)
"""Lengths of windows in time scales of the motion; None: the whole recording."""
LOST = 0.3  # error over the spread of a reading beyond which a horizon is too long
DOUBTED_ERROR = 0.05  # share of the spread: a larger error of the longest windows is doubted too
CLOSER = 0.5  # of the first search's error: below it, laws found in shorter windows replace it
DOUBTED_SHARE = 0.4  # of independent innovations, below which no law fits the machine quite
DEPENDENT = 0.3  # the same, below which values alone do not explain the recordings
LEAST_ROWS = 10  # of a window
QUIET = 5.0  # a reading that moves by fewer of its deviations says nothing of predictability
PREDICTABLE = 1.0  # time scales of the motion: windows in which chaotic motions are predictable
SHORT = 4.0  # time scales of the motion: windows in which candidates are fitted first
APPLIED_CURRENT = 3.0  # deviations of the sensor: a larger error is that of another current
LINEAR_GAIN = 3.0  # by which a linearly moving command must be better than a held one
UNLIKELY_TIMING = 500.0  # units behind: a timing with which no horizons are grown
SAME_END = 3.0  # units: growths from different starts whose ends differ by less end alike
ALIKE_EXCESS = 1e-3  # of the excess: searches of whole recordings that begin at such costs are one
TURNS = 0.1  # of the rows: a command that reverses in fewer is not smoothed
FAST_SHARE = 0.2  # of what smoothing removes, that acts: of five commands in a row one is logged
TIMING_DOUBT = 10.0  # units: a difference that does not tell a linear command from a held one
TIMING_SHARE = 0.1  # of the least law's gain, that another timing must gain for a new search
LEAST_GAIN = 8.0  # of a law
EVEN = 0.1  # of the mean: least scatter of the stretches in that ratio
MOST_OF_ONE = 20.0  # units of gain that one stretch counts in that ratio
KEPT_RATIO = 3.5  # the same at the end, when laws that others explain are gone
PULSE_GAIN = 15.0  # of a torque that acts once, before it is fitted
PULSE_CHOICE = 10.0  # units: logarithm of the number of intervals that were compared
PULSES = 2  # tried, of all recordings
WIDER, WIDER_TIMES = 6.0, 2  # factor of a size's bounds, and how often, where a fit ends at them
FORMS = 2  # other forms of an effect that are tried where one ends at a bound
PULSE_RATIO = 20.0  # of its gain to the scatter of the other stretches
PULSE_IN_WINDOWS = 2.0  # the same ratio of a pulse that whole recordings show
ONLY_PULSE = 40.0  # its gain over any other's, from which half that ratio is enough
PER_VALUE = 2.0  # more for each of its values
RICHER_GAIN = 5.0  # of a law with more values over the plainer one of its effect
RICHER_RIVAL = 0.7  # of the best worth: from there on a rival's richer laws are fitted too
AGAIN = 0.85  # of the taken law's worth: rivals that are ranked again in longer windows
ALIKE_GAIN, ALIKE_SHARE = 2.0, 0.03  # of one effect in two readings that cannot be told apart
ALONG = 0.1  # cosine over sine part of an unbalance that acts as the rig's own gravity
NEAR = 0.3  # of the best gain, from which a candidate is fitted once more from the best's values
PARENT = 0.6  # of a law's held-out gain, at which its plainer form is fitted in its place
PLAINER_SHARE = 0.85  # of the best gain, at which a law with fewer values is taken
NESTED_SHARE = 0.6  # the same, of an effect that holds the other one
FURTHER_GAIN = 12.0  # of a further law
FURTHER_SHARE, FURTHER_MOST = 0.02, 0.3  # and of what the first one gained, by dependence
DELAYS = (
    0.0,
    0.5,
    1.0,
    1.5,
    2.0,
    2.5,
    3.0,
    4.0,
    5.0,
    6.5,
    8.0,
    10.0,
    12.5,
    16.0,
    20.0,
    25.0,
    31.0,
    39.0,
    48.0,
    58.0,
)
"""Rows: starts of a late command."""
DELAYS_FITTED = 4  # of these, the best
DELAY_FIT = 1  # iterations from each of them
EVENT = 0.5  # time scales of the motion: shortest stretch of a gain
LEAST_RATIO = 2.5  # of the gain to its deviation between stretches of rows
FASTEST = 0.3  # cycles per row: a faster motion is not seen
FAR_FROM_RIG = 2.0  # tolerances from which values are fitted once more from the rig's
STRAINED = 2.5  # tolerances: a value beyond is biased by what the model lacks
CLOSE_TO_RIG = 1.0  # tolerance that such a value may move in a fit beside the rig file
WITHIN_ROW = 0.02  # of a row: a change of the winding's time constant that rows cannot tell
UNBELIEVED = 4.5  # tolerances: a value beyond, and no law, is no correction
NO_PREDICTION = 0.6  # error over the spread of a reading at which a law predicts nothing
NOT_BEYOND = 0.9  # share of the error in longer windows that a law of the machine does not leave
PREDICTION = 0.3  # the same at which laws do predict such a machine
FINE_STEPS = (2.0, 1.3)  # of noise that was estimated before
STEP_ERROR = 0.2  # deviations of innovations that the engine's step may move, root mean square
LONG_ROWS = 15000  # of a recording in which one mean command per row is tried
LOST_IN_NOISE = 0.05  # deviations of innovations that this may change, root mean square
FIRST_STEPS, SEARCH_STEPS = 25.0, 50.0  # per fastest cycle: as windows grow, in the law search
STEP_SHARE = 0.25  # of the misfit of whole recordings, that half the engine's step may change
LEAST_FINENESS, STEP_ROUNDS = 1.0 / 32.0, 3  # of such a step; looks
RICHARDSON = 4.0 / 3.0  # error of a step over what half of it changes, second order
SCANS = 3  # of all values, and values moved in each, where a fit of whole recordings ends
NEGLIGIBLE_FALL = 1e-4  # of the cost: a smaller fall ends these looks
SENSOR_COLOUR_ROWS = 20  # time constant of a sensor's coloured noise at most; longer: the model
SENSORS_ALONE = 0.003  # of the estimated unknown torques, where the sensors' noise is all there is
COMPLETE = 1.6  # misfit of whole recordings in noise deviations that is as good as none
SOUND = 2.0  # misfit of parameters alone, below which they are sufficient
BRIEFLY_SOUND = 1.1  # misfit of parameters alone, below which a brief look seeks no law
SOUND_IN_LEFT_NOISE = 1.4  # the same in the noise that the best law leaves
LEAST_EXCESS = 100.0  # cost above that of noise, from which a law is tried all the same
ZERO_SHARE = 0.5  # of a reading's excess in one recording: the least that its zero explains
ZERO_ELSEWHERE = 0.1  # of the fall of the cost there: the most in any other recording
START_ERROR = 0.01  # of an angle's spread: a start at rest that smoothing misses by more is as read
SHAPE_SHARE = 0.5  # of the excess of parameters alone: least held-out gain of a shape
OVERSTATED_NOISE = 0.7  # misfit with laws, below which noise was estimated far too large
NOISE_RENEWED = 3  # times that laws are then searched in the noise that they leave, at most
DRIFT_LEAVES, DRIFT_SHARE = 1.2, 0.5  # misfit with drifting offsets; share that these explain
MOST_LEFT = 0.67  # of the misfit's cost: a first law that leaves more is the last
MUCH_LEFT = 0.3  # of the misfit: a law that leaves more is the last, where nothing predicts
COMPLETE_SHARE = 0.08  # or of what parameters alone leave: small things that every machine has
ALIKE_OF_GAIN = 3e-4  # of the gain in whole recordings: laws that differ by less are alike
PRIOR_AMONG_ALIKE = 100.0  # units of gain that one of the prior's counts for among such laws
DOUBT = 0.1  # of what is left above the noise, in units: by so much rivals are not told apart
LEAST_OF_LEFT = 0.05  # of what laws gained on whole recordings so far: least gain of a further one
WHOLE_LAWS, WHOLE_TRIED, WHOLE_FORMS = 3, 24, 3  # laws at most, fitted each time, of one effect
LEFT_OF_EACH = 0.9  # of the misfit: a law that leaves more of it is none that completes a model
NEGLIGIBLE_INCREASE = 1.05  # ratio: of the misfit without a redundant law; of a cost held out
FITTED_ROWS = 0.6  # of each recording; a law must predict the others
UNPREDICTED = 0.5  # of what parameters alone leave of those: laws that leave more say nothing
EXPLAINED = 0.85  # of what parameters leave, all rows and unseen ones: a law that is nearly all
EXPLAINED_TOGETHER = 0.97  # of what parameters leave, by several laws: the least that they explain
NEARLY_EXPLAINED = 0.5  # of what other laws leave: a small law from there on is fitted to its end
NEEDS_NO_WINDOWS = 0.95  # of the same: a law that stands without a search in windows
MOST_FITTED_RISE = 1.33  # of the rise that insulation bears: a fitted rise is uncertain
NEIGHBOURS = 4  # of a law with a fixed number, as cycles in a turn: tried in its place
ORDERS = 2  # cycles of cogging in a turn, likeliest along the recorded motion: tried
QUICK_ITERATIONS, CLOSE_TO_BEST = 3, 0.5  # of laws that a screening puts last; of the best gain
CLOSE_FIRST, FIRST_RIVALS = 0.9, 2  # share of the first law's gain; rivals tried first
SHORTLISTED = 0.1  # of the best gain: laws that are tried again where commands act at other times
LEAST_OF_BEST = 0.25  # of the best gain so far: a fit that cannot gain this is not continued
COARSE_STEPS = (12.5, 25.0)  # per fastest cycle, of undivided rows: candidates are compared first
COARSE_SHARE = 0.1  # of the misfit, that these may change
FIRST_SHARE = 1 / 3  # of the limit of work, for growths and searches of whole recordings
WHOLE_RIVALS = 4  # of each law, fitted beside the others
OUTPUT_ERROR = 0.05  # of the estimated unknown torques, in a fit of whole predictions
NEARLY_ABSENT = (0.2, 0.05, 0.01)  # of the screened size: starts of a law that fitted worse
SECOND_STARTS = 4  # of the finished candidates, the best, get one
WEAK = 0.1  # of the best gain so far: a second start of a candidate that gains less is left out
SETTLING, SETTLED = 4, 2.0  # rounds of noise and fit at most; change of the cost that ends them
TRIED, FINISHED, LAWS = 7, 4, 2  # candidates fitted, fitted to the end; laws at most
TRIED_SHORT = 3  # more of those that short windows show
TRIED_APART = 2  # and of those that output errors, or a fit close to the rig file, show
UNCONVERGED, OWED = 4.0, 0.3  # units, share of a law's worth: a fit that gains this without the law
CONTINUATIONS = 3  # times that it takes the place of the one before, which had not converged
CONTENDS = 1.5  # times the gain, each in its own share: a law from which another search begins
COLOUR_ROWS = (3.0, 10.0, 30.0)  # that the coloured part of a reading's noise lasts
COLOUR_GAIN = 100.0  # units, not tempered, by which coloured noise must be likelier than white
MOST_COLOUR = 3.0  # times the white part of a reading's noise: larger errors are the model's
COLOUR_SHARE = 0.3  # of the time scale of the motion, that it lasts at most
DISAGREE = 3.0  # floors of a reading, by which the encoders of a rigid train differ
MESH_ROWS, MESH_TOLERANCE = 4.0, 0.5  # of a gear's mesh: rows of its cycle; share of its stiffness
LATE_ROWS = 0.5  # a command's delay from which each reading is tried with it instead
MOVES = 1.0  # sum of squares of what a law changes in the innovations, below which it is absent
FEWER_FINISHED = 2
SHAPE_GAIN, SHAPE_RATIO = 20.0, 4.5  # of a torque of unknown shape
SHAPE_BETTER, SHAPE_MORE = 1.2, 8.0  # over the named law's held-out gain: the name is no answer
RIVAL_SCALE, RIVAL_SHARE = 2.0, 0.02  # of a rival's odds: least, and of the gain
RATIO_AT, RATIO_SCALE = 2.8, 2.3  # gain over its deviation that convinces
GAIN_AT, GAIN_SCALE = 12.0, 2.0  # of a law: of the hundred tried, one gains so much by chance
INDEPENDENT = 0.6  # share of independent innovations below which a law is not all there is
LEAST_INDEPENDENT = 0.1  # of that share, for a law that gains evenly is one of the things there
HIGHEST, UNCLAIMED = 0.97, 0.45  # confidences
FURTHER = (1.0, 0.9)  # factors of the first and the second law's
FURTHER_RATIO_AT, FURTHER_RATIO_SCALE = 11.0, 1.0  # gain over its deviation of a further law
INERTIA_GAIN, INERTIA_RATIO = 100.0, 2.0  # of an inertia that varies with the angle: least
INERTIA_LEAST = 0.05  # of the inertia itself, that its wave has at least
UNKNOWN_MOST = 0.1  # of the usual torque: values that leave more explain no recording
UNKNOWN_SHARE = 0.005  # of the usual torque: a smaller unknown one is neither stated nor evidence
DELAY_ROWS = 1.5  # a row of the log and half a row of hold; a later command is late in the drive
WORSE = -2.0  # that a law may lose on recordings held out and stay in the model
LESS_ERROR = 0.95  # of the parameters' error of a reading held out, below which laws are better
ERRORS_BEYOND = 2.0  # standard errors of the mean difference of squared errors of windows
FEW_WINDOWS_ERROR = 0.5  # as LESS_ERROR, where windows are too few for a standard error
SILENT = 2.0  # gain or loss there from which recordings held out say something
OUTLIER = 12.0  # deviations of a row that stands out
SURE = 3.0  # tolerances that a value may move before a finding says so
UNEVEN_GAIN = 60.0  # of a law in few stretches of rows: something is there, whatever it is
