"""Progress of a job that another server does reaches whoever follows it here."""

from __future__ import annotations

from service.engines.shared_progress import SharedProgress
from service.jobs.progress import JobProgress, ProgressBoard
from tests.waiting import until


class Common:
    """What servers share."""

    def __init__(self):
        self.told = {}
        self.reads = []
        self.writes = 0

    def write(self, progress):
        self.writes += 1
        self.told |= progress

    def read(self, job_ids):
        self.reads.append(set(job_ids))
        return {one: self.told[one] for one in job_ids if one in self.told}


def test_what_one_board_tells_another_hears_while_somebody_follows():
    common, there, here = Common(), ProgressBoard(), ProgressBoard()
    theirs, mine = SharedProgress(there, common), SharedProgress(here, common)
    there.tell("a", JobProgress("voxelize", 0.1))
    theirs.exchange(write=True)
    theirs.exchange(write=True)
    assert common.writes == 1  # nothing new

    mine.exchange(write=True)
    assert common.reads == []  # nobody wants to know
    assert here.latest("a") is None
    mine.exchange(write=False)
    assert here.latest("a") == JobProgress("voxelize", 0.1)
    assert common.writes == 1  # what was heard is not told again

    heard = []
    here.listen("a", heard.append)
    there.tell("a", JobProgress("refine", 0.5))
    theirs.exchange(write=True)
    mine.exchange(write=False)
    mine.exchange(write=False)
    assert heard == ["a"]
    assert here.latest("a").stage == "refine"

    del common.told["a"]  # the attempt is over
    mine.exchange(write=False)
    assert heard == ["a", "a"]
    assert here.latest("a") is None


def test_a_job_that_is_done_here_is_not_looked_for():
    common, here = Common(), ProgressBoard()
    here.tell("a", JobProgress("voxelize", 0.1))
    here.latest("a")
    SharedProgress(here, common).exchange(write=False)
    assert common.reads == []
    common.told["a"] = JobProgress("refine", 0.9)
    here.hear({"a"}, common.told)
    assert here.latest("a").stage == "voxelize"


def test_it_goes_on_after_trouble(caplog):
    class Ill(Common):
        faults = 2

        def write(self, progress):
            if self.faults:
                self.faults -= 1
                raise RuntimeError("gone")
            super().write(progress)

    common, board = Ill(), ProgressBoard()
    board.tell("a", JobProgress("voxelize", 0.1))
    with SharedProgress(board, common).running():
        until(lambda: common.told)
    assert caplog.text.count("progress cannot be shared") == 1
