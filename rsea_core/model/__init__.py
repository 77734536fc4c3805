"""The machine with its effects: one model to simulate, control and fit."""
