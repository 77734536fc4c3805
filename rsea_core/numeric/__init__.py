"""Small numerical tools: arrays, splines, a Runge-Kutta tableau, transfer functions, threads."""
