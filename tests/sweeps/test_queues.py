# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep by jobs of SLURM, and by what queues are given in files: the real ones, also when jobs are killed."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from nim_addon.sweeps import cluster, export, plan, queues, results, state
from nim_addon.sweeps.orders import Order

from .dask_lab import ENVIRONMENT, PACKAGE, runs, wait, within


@pytest.fixture(scope="session")
def slurm(tmp_path_factory):
    """A SLURM of two nodes on this machine: its folder."""
    if not all(map(shutil.which, ("slurmctld", "slurmd", "munged"))) or os.geteuid():
        pytest.skip("needs SLURM and munge, and root")
    from .slurm_lab import started

    with started(tmp_path_factory.mktemp("slurm")) as folder:
        yield folder


@pytest.fixture
def queue(slurm, monkeypatch):
    """The commands of SLURM speak with that one."""
    monkeypatch.setenv("SLURM_CONF", str(slurm / "slurm.conf"))


def test_jobs_of_a_queue(spheres, sweep, tmp_path, queue):
    pytest.importorskip("dask_jobqueue")
    tasks = spheres(-2, -1.5, -1)
    plan.write(tmp_path, tasks)
    problems, at = sweep(tasks, cluster.engine("slurm"))
    assert (problems, at.done) == ([], 3) and results.to_do(tmp_path, tasks) == []
    wait(lambda: not subprocess.run(["squeue", "-h"], capture_output=True, text=True).stdout.strip(), 60)


def job_of(worker):
    """The number of the job that a worker of that name runs in."""
    pids = [int(folder.name) for folder in Path("/proc").glob("[0-9]*")]
    pid = next(pid for pid in pids if runs(pid, f"--name\0{worker}\0"))
    variables = Path(f"/proc/{pid}/environ").read_text().split("\0")
    return next(line for line in variables if line.startswith("SLURM_JOB_ID=")).partition("=")[2]


class Ended(Exception):
    """The queue has ended all of the jobs, as is said."""


@pytest.fixture
def soon():
    """Dask takes a worker that is gone to be gone for good at once, not after 15 s."""
    dask = pytest.importorskip("dask")
    pytest.importorskip("dask_jobqueue")
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "1s"}):
        yield


class Killing(state.State):
    """The state of a sweep that ends the job of each of the first times that something is begun."""

    def __init__(self, folder, count, times):
        super().__init__(folder, count, kept=False)
        self.times, self.lost, self.said = times, [], []

    def began(self, name, order):
        if len(self.lost) < self.times:
            self.lost.append(job_of(name.removeprefix("worker ")))
            subprocess.run(["scancel", self.lost[-1]], check=True)

    def waits(self, why):
        self.said.append(why)
        if len(self.lost) == self.times and why.startswith("the queue has ended all of the jobs; squeue says why"):
            raise Ended(why)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_job_that_is_lost(spheres, tmp_path, queue, soon, jobs):
    """Another takes its place."""
    tasks = spheres(-2, -1.5, -1, samples=16)
    plan.write(tmp_path, tasks)
    watch = Killing(tmp_path, 3, 1)
    with within(240):
        done = list(cluster.engine("slurm", jobs=jobs)([Order(task) for task in tasks], tmp_path, watch))
    assert all(outcome.problem is None for _, outcome in done) and results.to_do(tmp_path, tasks) == []
    assert watch.lost
    wait(lambda: not subprocess.run(["squeue", "-h"], capture_output=True, text=True).stdout.strip(), 60)


def test_a_queue_that_ends_every_job(spheres, tmp_path, queue, soon, monkeypatch):
    """After three jobs that rendered nothing no other is handed in, and that is said."""
    monkeypatch.setattr(cluster, "ALONE", 0.5)
    tasks = spheres(-1, samples=4096)
    plan.write(tmp_path, tasks)
    watch = Killing(tmp_path, 1, 3)
    with within(240), pytest.raises(Ended):
        list(cluster.engine("slurm", jobs=1)([Order(task) for task in tasks], tmp_path, watch))
    assert len(set(watch.lost)) == 3
    assert "the queue has ended all of the jobs, and others are handed in" in {said[:61] for said in watch.said}


def test_a_queue_none_of_whose_nodes_answers(queue):
    """It takes the job and keeps it, so it is not refused, and nothing is left in the queue."""
    nodes = ["scontrol", "update", "nodename=n1,n2"]
    subprocess.run([*nodes, "state=down", "reason=test"], check=True)
    try:
        script = "#!/bin/sh\n#SBATCH --output=/dev/null\n#SBATCH --mem={}G\nexit 1\n"
        queues.check(script.format(2))
        assert not subprocess.run(["squeue", "-h"], capture_output=True, text=True).stdout.strip()
        with pytest.raises(
            RuntimeError, match=r"the queue refuses the job: .*Memory specification can not be satisfied"
        ):
            queues.check(script.format(900))
    finally:
        subprocess.run([*nodes, "state=resume"], check=True)


def test_a_queue_that_refuses_the_job(spheres, sweep, queue):
    pytest.importorskip("dask_jobqueue")
    with pytest.raises(RuntimeError, match=r"the queue refuses the job: .*artition"):
        sweep(spheres(-1), cluster.engine("slurm", options=["--partition=none"]))


def test_a_machine_without_a_queue(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(RuntimeError, match="there is no sbatch here"):
        queues.check("#!/bin/bash\n")


def test_a_queue_that_does_not_answer(tmp_path, monkeypatch):
    (tmp_path / "sbatch").write_text("#!/bin/sh\nexec sleep 30\n")
    (tmp_path / "sbatch").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(queues, "ANSWER", 0.2)
    with pytest.raises(RuntimeError, match=r"the queue does not answer sbatch within 0\.2 s"):
        queues.check("#!/bin/bash\n")


def test_a_folder_that_slurm_cannot_be_told_of(spheres, tmp_path):
    with pytest.raises(ValueError, match="no folder with a line break in its name"):
        export.write("slurm", tmp_path / "a\nb", spheres(-1))


def test_a_job_array_of_which_a_job_is_killed(spheres, tmp_path, queue):
    """Killed in the middle, the step that puts all together renders what is missing; of a folder with an odd name."""
    tmp_path = tmp_path / "it's 100 %a"
    tmp_path.mkdir()
    tasks = spheres(-2, -1.5, -1, -0.5, samples=64, size=(100, 75))
    plan.write(tmp_path, tasks)
    export.write("slurm", tmp_path, tasks, chunk=2, words=["--measure=mean"])
    submitted = subprocess.run(
        ["bash", tmp_path / "slurm-submit.sh"],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **PACKAGE},
    )
    job = submitted.stdout.split()[-1]
    wait(lambda: list((tmp_path / "images").rglob("*.json")), 120)
    array = str(int(job) - 1)
    subprocess.run(["scancel", "--signal=KILL", "--full", f"{array}_0"], check=False)
    wait(lambda: (tmp_path / "index.html").exists(), 240)
    assert results.to_do(tmp_path, tasks) == []
    assert {file.name for file in tmp_path.glob("slurm-*.log")} == {"slurm-0.log", "slurm-1.log", "slurm-collect.log"}
    assert "mean" in (tmp_path / "table.csv").read_text().splitlines()[0]


def test_a_template_of_open_job_description(spheres, tmp_path):
    tasks = spheres(-2, -1.5, -1)
    plan.write(tmp_path, tasks)
    (file,) = export.write("openjd", tmp_path, tasks, chunk=2, words=["--measure=mean"])
    template = json.loads(file.read_text())
    lines = template["steps"][0]["parameterSpace"]["taskParameterDefinitions"][0]
    assert (lines["range"], lines["chunks"]["defaultTaskCount"]) == ("1-3", 2)
    render, collect = (step["script"]["actions"]["onRun"]["args"] for step in template["steps"])
    assert render[-4:] == ["{{Param.Folder}}/plan.jsonl", "--lines", "{{Task.Param.Lines}}", "--quiet"]
    assert collect[-2:] == ["{{Param.Folder}}/plan.jsonl", "--measure=mean"]
    openjd = Path(sys.executable).with_name("openjd")
    if not openjd.exists():
        pytest.skip("needs openjd-cli")
    done = subprocess.run([openjd, "run", file, "--run-dependencies"], capture_output=True, text=True, env=ENVIRONMENT)
    assert done.returncode == 0, done.stdout[-3000:]
    assert "Chunks run: 3" in done.stdout  # two of tasks, and what puts all together
    assert results.to_do(tmp_path, tasks) == []
    assert "mean" in (tmp_path / "table.csv").read_text().splitlines()[0]
