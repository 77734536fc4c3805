"""Numbers by which the multistep search decides; gains are tempered log-likelihood units."""

HORIZONS = (0.1, 0.3, 1.0, 4.0, 16.0, None)
"""Lengths of windows in time scales of the motion; None: the whole recording."""
LOST = 0.3  # error over the spread of a reading beyond which a horizon is too long
LEAST_ROWS = 10  # of a window
QUIET = 5.0  # a reading that moves by fewer of its deviations says nothing of predictability
SHORT = 4.0  # time scales of the motion: windows in which candidates are fitted first
LINEAR_GAIN = 3.0  # by which a linearly moving command must be better than a held one
LEAST_GAIN = 8.0  # of a law
PER_VALUE = 2.0  # more for each of its values
RICHER_GAIN = 5.0  # of a law with more values over the plainer one of its effect
ALIKE_GAIN, ALIKE_SHARE = 2.0, 0.03  # of one effect in two readings that cannot be told apart
PLAINER_SHARE = 0.85  # of the best gain, at which a law with fewer values is taken
FURTHER_GAIN = 12.0  # of a further law
FURTHER_SHARE, FURTHER_MOST = 0.02, 0.3  # and of what the first one gained, by dependence
LEAST_RATIO = 2.5  # of the gain to its deviation between stretches of rows
FASTEST = 0.3  # cycles per row: a faster motion is not seen
BENT = 2.0  # tolerances from which values are fitted once more from the rig's
FINE_STEPS = (2.0, 1.3)  # of noise that was estimated before
SETTLING, SETTLED = 4, 2.0  # rounds of noise and fit at most; change of the cost that ends them
TRIED, FINISHED, LAWS = 7, 4, 3  # candidates fitted, fitted to the end; laws at most
TRIED_SHORT = 3  # more of those that short windows show
FEWER_FINISHED, FEWER_LAWS = 2, 2
SHAPE_GAIN, SHAPE_RATIO = 20.0, 4.5  # of a torque of unknown shape
SHAPE_BETTER, SHAPE_MORE = 1.2, 8.0  # over the named law's held-out gain: the name is no answer
RIVAL_SCALE, RIVAL_SHARE = 2.0, 0.02  # of a rival's odds: least, and of the gain
RATIO_AT, RATIO_SCALE = 1.5, 1.2  # gain over its deviation that convinces
HIGHEST, UNCLAIMED = 0.97, 0.45  # confidences
FURTHER = (1.0, 0.9, 0.7)  # factors of the first, second, third law's
DEPENDENT = 0.4  # share of independent innovations below which further laws are doubted
DELAY_ROWS = 2.5  # a command that acts later than this is the drive's, not the log's
WORSE = -2.0  # that a claim may lose on recordings held out
OUTLIER = 12.0  # deviations of a row that stands out
SURE = 5.0  # tolerances that a value may move before a finding says so
