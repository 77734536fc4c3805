"""Health of recordings, slips of a log or rig file, and which of forty would be noticed."""
