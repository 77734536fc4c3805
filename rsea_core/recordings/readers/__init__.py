"""Logs as other programs write them: one file for each format, each giving a `Log`."""
