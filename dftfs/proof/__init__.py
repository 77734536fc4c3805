"""The proof: rigs with concealed effects, sealed labels, blind runs, scores and baselines.

``machine``, ``truth_*``, ``readings`` and the case makers import nothing of `rsea_core`: the
machine that the recordings come from is written twice in this repository, from two sets of laws
and by two integrators, so that a diagnosis cannot succeed by sharing a mistake with its judge.
"""
