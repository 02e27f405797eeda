"""Times Stone Soup's JPDAF on the scans of the benchmark `trackers`, and holds it against where our tracks end.

    time_stonesoup.py QUESTION ANSWER

The benchmark calls this; both are JSON files, see main.rs. Needs `pip install stonesoup pyehm`.
"""

import datetime
import json
import os
import sys
import time
from importlib.metadata import version

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
try:
    import numpy as np
    from pyehm.plugins.stonesoup import JPDAWithEHM2
    from stonesoup.dataassociator.probability import JPDA
    from stonesoup.functions import gm_reduce_single
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.nonlinear import CartesianToBearingRange
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.types.update import GaussianStateUpdate
    from stonesoup.updater.kalman import ExtendedKalmanUpdater
except ImportError as error:
    sys.exit(f"time_stonesoup.py: {error}")

START = datetime.datetime(2026, 1, 1)


def follow(question, associator):
    """Seconds a scan, and the tracks."""
    motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(question["noise"])] * 2)
    noise = np.diag([question["sigma_azimuth"] ** 2, question["sigma_range"] ** 2])
    radar = CartesianToBearingRange(ndim_state=4, mapping=(0, 2), noise_covar=noise)
    updater = ExtendedKalmanUpdater(radar)
    gate = 1 - np.exp(-question["threshold"] / 2)
    hypothesiser = PDAHypothesiser(
        KalmanPredictor(motion),
        updater,
        clutter_spatial_density=question["clutter_density"],
        prob_detect=question["p_detect"],
        prob_gate=gate,
    )
    associate = associator(hypothesiser).associate
    cov = np.diag(np.tile(np.square(question["sigma"]), 2))
    tracks = [Track([GaussianState(x, cov, timestamp=START)]) for x in question["targets"]]
    spent = 0.0
    for k, plots in enumerate(question["scans"]):
        now = START + datetime.timedelta(seconds=question["period"] * k)
        detections = {Detection([a, r], timestamp=now, measurement_model=radar) for r, a in plots}
        start = time.perf_counter()
        hypotheses = associate(set(tracks), detections, now)
        for track in tracks:
            states = [updater.update(h) if h else h.prediction for h in hypotheses[track]]
            means = StateVectors([s.state_vector for s in states])
            covs = np.stack([s.covar for s in states], axis=2)
            weights = np.array([float(h.probability) for h in hypotheses[track]])
            track.append(GaussianStateUpdate(*gm_reduce_single(means, covs, weights), hypotheses[track], now))
        spent += time.perf_counter() - start
    return spent / len(question["scans"]), tracks


def main(asked, answered):
    with open(asked) as file:
        question = json.load(file)
    answer, apart = {"version": version("stonesoup")}, 0.0
    for name, associator in [("jpda", JPDA), ("ehm2", JPDAWithEHM2)]:
        seconds, tracks = follow(question, associator)
        answer[name] = min(seconds, follow(question, associator)[0])
        for track, mean, cov in zip(tracks, question["means"], question["covs"]):
            sigma = np.sqrt(np.array(cov)[::5])
            apart = max(apart, float(np.max(np.abs(np.ravel(track.mean).astype(float) - mean) / sigma)))
    with open(answered, "w") as file:
        json.dump(answer | {"difference": apart}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
