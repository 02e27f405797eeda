"""Times EHM2 of PyEHM (C++ behind Python) on the problems of the association benchmark.

    time_pyehm.py PROBLEMS TIMES

The benchmark calls this; PROBLEMS and TIMES are JSON files, see association/pyehm.rs. Needs `pip install pyehm`.
Every problem is a process of its own, so that one beyond the time limit can be ended inside C++.

Horridge and Maskell, "Real-time tracking of hundreds of targets with efficient exact JPDAF implementation", 2006.
"""

import json
import os
import signal
import sys
import time
from importlib.metadata import version

try:
    import numpy as np
    from pyehm.core import EHM2
except ImportError as error:
    sys.exit(f"time_pyehm.py: {error}")

LIMIT = 1.0  # seconds for one call
BATCH = 0.005  # seconds of calls timed together
SPENT = 0.06  # seconds spent on a problem


def shortest(call):
    """Seconds per call in the shortest of several batches."""
    signal.setitimer(signal.ITIMER_REAL, LIMIT)
    start = time.perf_counter()
    call()
    best = time.perf_counter() - start
    signal.setitimer(signal.ITIMER_REAL, 0)
    end = time.perf_counter() + SPENT
    while time.perf_counter() < end:
        calls = max(1, int(BATCH / best))
        start = time.perf_counter()
        for _ in range(calls):
            call()
        best = min(best, (time.perf_counter() - start) / calls)
    return best


def associate(miss, hit, marginals=None, name=""):
    """Seconds, and the largest difference from `marginals`."""
    # In the memory layout that C++ takes: nothing is converted on the way.
    weights = np.asfortranarray(np.column_stack([miss, hit]))
    gates = np.asfortranarray(weights > 0, dtype=np.int32)
    ehm2 = EHM2()
    seconds = shortest(lambda: ehm2.run(gates, weights))
    apart = 0.0 if marginals is None else np.abs(ehm2.run(gates, weights) - marginals).max()
    return seconds, float(apart)


def in_child(problem):
    """What `associate` says, or None where the time limit ended it."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.write(write, json.dumps(associate(**problem)).encode())
            status = 0
        finally:
            os._exit(status)
    os.close(write)
    with open(read) as answer:
        text = answer.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status == -signal.SIGALRM:
        return None
    if status != 0:
        sys.exit(f"time_pyehm.py: {problem['name']} ended with {status}")
    return json.loads(text)


def main(problems, times):
    with open(problems) as file:
        answers = {problem["name"]: in_child(problem) for problem in json.load(file)}
    call, _ = associate([0.3], [[1.0]])
    done = [answer for answer in answers.values() if answer]
    with open(times, "w") as file:
        json.dump(
            {
                "version": version("pyehm"),
                "call": call,
                "limit": LIMIT,
                "seconds": {name: answer and answer[0] for name, answer in answers.items()},
                "difference": max((apart for _, apart in done), default=0.0),
            },
            file,
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
