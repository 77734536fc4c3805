"""Order 8 with located events and an energy ledger."""
