"""Where recordings and simulation differ: ports, signatures, unknown inputs."""
