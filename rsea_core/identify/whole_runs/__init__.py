"""Whole recordings in the noise of the sensors alone: is a hypothesis all that there is?"""
