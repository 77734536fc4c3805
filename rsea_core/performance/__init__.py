"""What a machine can do: bandwidth, efficiency, limits, Table 2.1."""
