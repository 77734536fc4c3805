"""How a table of text is written, and what its cells mean."""
