"""Terms in files: the [[term]] tables of models, and of the rig file of a case."""
