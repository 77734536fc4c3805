"""The engines that solve a model."""
