"""The spring as geometry and closed forms: no finite elements, no CAD."""
