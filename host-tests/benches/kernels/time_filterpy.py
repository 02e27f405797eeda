"""Times FilterPy on the filters of the benchmark `kernels`, and holds it against where ours end.

    time_filterpy.py FILTERS TIMES

The benchmark calls this; FILTERS and TIMES are JSON files, see main.rs. Needs `pip install filterpy`.
"""

import json
import os
import sys
import time
from importlib.metadata import version

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
try:
    import numpy as np
    from filterpy.kalman import IMMEstimator, KalmanFilter
except ImportError as error:
    sys.exit(f"time_filterpy.py: {error}")

SPENT = 1.0  # seconds spent on a filter


def kalman(case, mode):
    f = np.array(case["f"][mode])
    kf = KalmanFilter(dim_x=len(f), dim_z=len(case["h"]))
    kf.F, kf.Q, kf.H, kf.R = f, np.array(case["q"][mode]), np.array(case["h"]), np.array(case["r"])
    kf.x, kf.P = np.array(case["x"][mode]), np.array(case["p"][mode])
    return kf


def run(case, plots):
    """Seconds for all scans, and the filter as it ends."""
    kfs = [kalman(case, mode) for mode in range(len(case["f"]))]
    estimator = kfs[0] if len(kfs) == 1 else IMMEstimator(kfs, case["prob"], np.array(case["jump"]))
    start = time.perf_counter()
    for z in plots:
        estimator.predict()
        estimator.update(z)
    return time.perf_counter() - start, estimator


def difference(estimator, case):
    """The largest difference in standard deviations, or products of two."""
    mean, cov = np.array(case["mean"]), np.array(case["cov"])
    sigma = np.sqrt(np.diag(cov))
    means = np.abs(estimator.x - mean) / sigma
    return float(max(means.max(), (np.abs(estimator.P - cov) / np.outer(sigma, sigma)).max()))


def main(filters, times):
    seconds, apart = {}, 0.0
    with open(filters) as file:
        cases = json.load(file)
    for case in cases:
        plots = np.array(case["z"])
        end, best = time.perf_counter() + SPENT, float("inf")
        while time.perf_counter() < end:
            spent, estimator = run(case, plots)
            best = min(best, spent)
        seconds[case["name"]] = best
        apart = max(apart, difference(estimator, case))
    with open(times, "w") as file:
        json.dump({"version": version("filterpy"), "seconds": seconds, "difference": apart}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
