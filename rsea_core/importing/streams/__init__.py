"""Columns of a log as they stand there: what names tell, the common clock, angles that wrap."""
