"""The physics that a rig file does not state; one file an effect.

The registry is imported before any module of the package, so that the effects' numbers have the
same places in every process (`slots`).
"""

from rsea_core.effects import registry as _registry  # noqa: F401
