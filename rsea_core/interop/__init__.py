"""Other tools: MuJoCo, gymnasium, python-control, NetCDF and Parquet."""
