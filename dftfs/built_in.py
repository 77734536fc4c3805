"""Designs that come with the package, by name: no more than a command's help needs."""

from importlib import resources


def built_in_names() -> tuple[str, ...]:
    """Names of the designs that come with the package."""
    folder = resources.files("dftfs") / "data" / "designs"
    return tuple(sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml")))
