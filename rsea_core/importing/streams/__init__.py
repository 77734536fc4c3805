"""The streams of a log on one clock: which clock they have in common, angles that wrap."""
