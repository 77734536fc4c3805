"""From recordings to what is missing in the model: smoothing, locating, naming, proving."""
