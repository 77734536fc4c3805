"""The next experiment: what to record to tell rival hypotheses apart."""
