"""TOML tables and CSV columns, read without letting anything pass unseen."""
