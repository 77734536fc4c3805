"""The CAD solid and its files. Only this package imports cadquery."""
