"""A pool that does jobs in this process, from what would cross to another one."""

from __future__ import annotations

from simplifier.pools import Answer, Arrived, JobOutcome, answer_of, joined, start_work


class InProcessPool:
    """``spoil(place, result)`` may stand in for an answer; ``done`` counts the jobs."""

    where = "in this process"

    def __init__(self, spoil=lambda place, result: result):
        self._spoil = spoil
        self.done = 0
        self.shared = None

    def run_jobs(self, work, shared, jobs, cancel=None):
        self.shared = shared
        arrays = {name: joined(pieces).copy() for name, pieces in shared.arrays.items()}
        for array in arrays.values():
            array.flags.writeable = False
        do = start_work(work, Arrived(shared.settings, arrays))
        for place in reversed(range(len(jobs))):  # in any order
            if cancel is not None and cancel.is_set():
                return
            answer = answer_of(do, jobs[place].data)
            self.done += 1
            if not answer.failure:
                spoilt = self._spoil(place, answer.result)
                answer = spoilt if isinstance(spoilt, Answer) else Answer(spoilt)
            yield JobOutcome(place, answer)
