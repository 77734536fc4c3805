"""A formula for what no named law explains."""
