"""Fixed steps, fast: replays for fits, batches for tuning."""
