# SPDX-License-Identifier: GPL-3.0-or-later
"""Workers of Dask that are jobs of a SLURM queue."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from . import export

TRIES = 3  # of what is rendered, and of what is to render it, before it is left
ANSWER = 60  # seconds for the queue to answer
PAGES = "127.0.0.1:0"  # of schedulers and workers, which anybody may read: for this machine, at any port


@contextlib.contextmanager
def started(folder: Path, jobs: int, options: Sequence[str], interface: str, security: Any = None) -> Iterator[Any]:
    """Within, a scheduler runs here and so many jobs are handed in; it is what a Client of Dask takes.

    options: of sbatch, for each job; interface: network interface that the scheduler listens on, with security, certificates
    of distributed.Security, if any. Raises RuntimeError, one sentence, where the queue would not take them.
    """
    from dask_jobqueue.slurm import SLURMCluster  # pyright: ignore[reportMissingImports]

    shared = Path(folder) / ".queue"
    shared.mkdir(exist_ok=True)
    with SLURMCluster(
        cores=1,
        processes=1,
        memory="2GB",
        nanny=True,
        interface=interface,
        python=sys.executable,
        local_directory=tempfile.gettempdir(),
        log_directory=str(shared),
        job_script_prologue=export.prologue(),
        job_extra_directives=list(options),
        scheduler_options={"dashboard_address": PAGES, "dashboard": False},
        worker_extra_args=["--no-dashboard", "--dashboard-address", PAGES],
        **({"security": security, "shared_temp_directory": str(shared)} if security else {}),
    ) as cluster:
        check(cluster.job_script())
        cluster.scale(jobs=jobs)
        yield cluster


class Jobs:
    """Jobs of a queue: for one that has ended another is handed in, unless TRIES in a row have rendered nothing.

    cluster: of started(); count: how many jobs are to be there.
    """

    def __init__(self, cluster: Any, count: int) -> None:
        self.cluster, self.count = cluster, count
        self.whole = False  # whether all that are to be there have been handed in
        self.rendered()

    def rendered(self) -> None:
        """To be called as something has been rendered: jobs are worth their while."""
        self.left = (TRIES - 1) * self.count

    def look(self) -> None:
        """Hand in others for those that have ended, which Dask takes to be so 15 s after their worker is gone."""
        ended = len(self.cluster.worker_spec) - len(self.cluster.workers)
        if not ended:
            self.whole = True
        elif self.whole and ended <= self.left:
            self.whole = False
            self.left -= ended
            self.cluster.scale(jobs=self.count)

    def without(self, ever: bool) -> str:
        """A sentence: there is no worker; ever: whether there was one."""
        what = "has started none of the jobs yet" if not ever else "has ended all of the jobs"
        then = ", and others are handed in" if ever and self.left else ""
        return f"the queue {what}{then}; squeue says why. Ctrl-C ends the sweep, and the same command goes on with it."


def check(script: str) -> None:
    """Raise RuntimeError, one sentence, where the queue would not take the job of that script.

    Asked what it would do, SLURM refuses too what it would take and keep, such as while no node answers. So where it does, a
    job with the script's demands that does nothing is handed in, and taken back.
    """
    asked = _asked(["sbatch", "--test-only"], script)
    if not asked.returncode:
        return
    demands = [line for line in script.splitlines() if line.startswith("#")]
    taken = _asked(["sbatch", "--parsable"], "\n".join([*demands, "exit 0", ""]))
    if taken.returncode:
        raise RuntimeError(f"the queue refuses the job: {' '.join(taken.stderr.split())}")
    _asked(["scancel", taken.stdout.split(";")[0].strip()])


def _asked(words, said=""):
    try:
        return subprocess.run(words, input=said, capture_output=True, text=True, timeout=ANSWER, check=False)
    except FileNotFoundError:
        raise RuntimeError(f"there is no {words[0]} here; run this on a machine that hands jobs to SLURM.") from None
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"the queue does not answer {words[0]} within {ANSWER} s; see whether it runs.") from None
