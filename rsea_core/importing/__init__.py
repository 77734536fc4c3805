"""A stranger's log: which column is which, in which unit and sign, and what cannot be decided."""
