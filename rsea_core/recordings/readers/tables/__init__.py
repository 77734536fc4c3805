"""Tables of text: how one is written, its rows, and what its cells mean."""
