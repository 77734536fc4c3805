"""The study of one design."""
