"""Thresholds that turn a fit into a verdict and a confidence.

What each is, what it was set on and what guards it stands in `judgement.thresholds`.
"""

CLEAR_MSNI, UNCHANGED_SHARE = 5.0, 0.5
HARDLY_CHANGED = 0.9
PART_OF_MISMATCH = 1.0 / 3.0
# of 255 claims as sure on four sets of concealed cases none was wrong (rule of succession: 0.996,
# and those sets helped to make the program)
HIGHEST_CONFIDENCE = 0.99
BELIEF_MARGIN, BELIEF_STEEPNESS = 0.05, 12.0
# on four sets of concealed cases 59 of 60 further effects were right (by the rule of succession
# 0.97), 14 of 14 that one recording alone showed
FURTHER_CONFIDENCE, UNDECIDED_CONFIDENCE = 0.97, 0.9
UNCLAIMED_CONFIDENCE = 0.45
MOST_UNDETECTABLE = 0.5
DETECTED_GAIN = 40.0
UNBALANCE_OFFSET_rad, UNBALANCE_TOLERANCES = 0.02, 3.0
SHOWN_STD = 2.0
IN_CONTACT = 0.95
# what errs in a spring follows its deflection; a signal in its place that forgets itself faster
# swings by itself, and between motor and load only the gear has mass to swing
OWN_PACE_s = 0.02
