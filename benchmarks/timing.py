"""Paired timings: what is compared runs in turns, the best of each counts."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

MOST_REPEATS, TURN_s = 50, 0.1


def interleaved(clock: Callable[[], float], rounds: int, *runs: Callable) -> tuple[list, list]:
    """Best time of each run [s] and the last results; in every round each has a turn of TURN_s."""
    best, results = [np.inf] * len(runs), [None] * len(runs)
    for _ in range(rounds):
        for index, run in enumerate(runs):
            begun = clock()
            for _ in range(MOST_REPEATS):
                start = clock()
                results[index] = run()
                end = clock()
                best[index] = min(best[index], end - start)
                if end - begun > TURN_s:
                    break
    return best, results


def rms(difference: NDArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(difference**2)))


def judged(what: str, value: float, least: float) -> bool:
    """Print a ratio with its target."""
    print(f"  {what}: {value:.1f} (target {least:g}) {'met' if value >= least else 'MISSED'}")
    return value >= least
