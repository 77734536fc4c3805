"""The best spring for a requirement."""
