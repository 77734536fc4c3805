"""From spring parameters to CAD, finite elements, an actuator and a report.

Units: SI and radians everywhere inside; mm, degrees and MPa only where a person reads or
writes (command line, design files, reports), always with the unit in the name.

Sign: a positive deflection *winds* the spring (the arms tighten on the hub), a negative one
*unwinds* it (the arms open towards the rim). Positive torque goes with positive deflection.
"""

__version__ = "0.2.0"
