"""The self-contained HTML report of a study; the only package that draws."""
