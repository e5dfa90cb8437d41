# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep by Dask, the real one: also when workers and schedulers are killed, and come and go."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest

from nim_addon.sweeps import cluster, plan, results, run, state
from nim_addon.sweeps.orders import Order

from .dask_lab import ENVIRONMENT, PACKAGE, SCHEDULER, WORKER, end, pids_of, runs, standing, wait, within

distributed = pytest.importorskip("distributed")
psutil = pytest.importorskip("psutil")


@pytest.fixture
def scheduler():
    """A scheduler that stands, with one worker: (its process, its address, the worker's process)."""
    stands, address = standing(*SCHEDULER)
    worker, _ = standing("distributed.cli.dask_worker", address, "--nthreads", "1", *WORKER)
    yield stands, address, worker
    end(worker, stands)


def test_dask_on_this_machine(spheres, sweep, tmp_path):
    """Its workers are in this process; beside it are their Blenders only, of which one is killed."""
    tasks = spheres(-2, -1.5, -1)
    plan.write(tmp_path, tasks)
    beside = []

    def ended(order, outcome):
        if not beside:
            beside.extend(psutil.Process().children())
            os.kill(beside[0].pid, signal.SIGKILL)

    before = psutil.Process().children()
    problems, at = sweep(tasks, cluster.engine("dask"), ended)
    assert (problems, at.done) == ([], 3) and results.to_do(tmp_path, tasks) == []
    assert set(at.record()["workers"]) == {"worker 0", "worker 1"}
    ours = [process for process in beside if process not in before]
    assert len(ours) == 2 and not any(process.is_running() for process in ours)
    assert psutil.Process().children() == before


def test_dask_on_this_machine_given_up_in_the_middle(spheres, tmp_path):
    tasks = [*spheres(-2), *spheres(-1.5, size=(400, 300), samples=4096)]
    plan.write(tmp_path, tasks)
    orders = [Order(task) for task in tasks]
    carried_out = cluster.engine("dask", workers=2)(orders, tmp_path, state.State(tmp_path, 2, kept=False))
    assert next(carried_out)[0] == orders[0]
    carried_out.close()
    assert not any(runs(pid, "sweeps.child") for pid in pids_of(os.getpid()))
    assert results.to_do(tmp_path, tasks) == tasks[1:]


def test_a_worker_that_is_killed_in_a_render(spheres, sweep, tmp_path, scheduler):
    """It is started anew by its nanny, and what it rendered is rendered again."""
    _, address, worker = scheduler
    tasks = spheres(-2, -1.5, -1, samples=16)
    plan.write(tmp_path, tasks)
    killed = []

    def ended(order, outcome):
        if not killed:
            for pid in pids_of(worker.pid):  # the worker that the nanny has started, and its Blender
                if runs(pid, "sweeps.child") or runs(pid, "spawn_main"):
                    killed.append(pid)
                    os.kill(pid, signal.SIGKILL)

    problems, at = sweep(tasks, cluster.engine("dask", address), ended)
    assert len(killed) == 2 and problems == [] and at.done == 3 and results.to_do(tmp_path, tasks) == []


def test_a_task_of_which_all_workers_die_is_given_up_by_dask(spheres, sweep, tmp_path, monkeypatch):
    """With its sentence."""
    monkeypatch.setattr(cluster, "TRIES", 1)
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    stands, address = standing(*SCHEDULER)
    worker, _ = standing("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", *WORKER)
    tasks = spheres(-1)
    plan.write(tmp_path, tasks)
    monkeypatch.setattr(state.State, "began", lambda self, name, order: worker.kill())
    try:
        (problem,), at = sweep(tasks, cluster.engine("dask", address))
        assert problem.problem.startswith("Dask has given it up: Attempted to run task ")
        assert at.failed == 1 and results.to_do(tmp_path, tasks) == tasks
    finally:
        end(worker, stands)


def test_a_scheduler_that_is_killed_and_stands_anew(spheres, sweep, tmp_path, scheduler):
    """What is done is kept; the same again goes on from there."""
    stands, address, _ = scheduler
    tasks = spheres(-2, -1.5, -1, samples=16)
    plan.write(tmp_path, tasks)

    def ended(order, outcome):
        stands.kill()

    with pytest.raises(RuntimeError, match="the scheduler is gone"):
        sweep(tasks, cluster.engine("dask", address), ended)
    left = results.to_do(tmp_path, tasks)
    assert 0 < len(left) < 3
    assert sweep(tasks)[0] == [] and results.to_do(tmp_path, tasks) == []


def test_a_sweep_that_is_given_up_ends_its_renders(spheres, tmp_path, scheduler):
    """Closed in the middle, no Blender of a worker renders on."""
    _, address, worker = scheduler
    tasks = spheres(-2, -1.5, size=(400, 300), samples=512)
    plan.write(tmp_path, tasks)
    code = (
        "import sys; from pathlib import Path; from nim_addon.sweeps import cluster, plan; "
        "from nim_addon.sweeps.orders import Order; from nim_addon.sweeps.state import State; "
        f"f = Path({str(tmp_path)!r}); o = [Order(t) for t in plan.read(f / 'plan.jsonl')]; "
        f"list(cluster.engine('dask', {address!r})(o, f, State(f, 2, kept=False)))"
    )
    client = subprocess.Popen([sys.executable, "-c", code], env=ENVIRONMENT, stderr=subprocess.DEVNULL)
    try:
        wait(lambda: any(runs(pid, "sweeps.child") for pid in pids_of(worker.pid)), 60)
        time.sleep(1)
    finally:
        client.kill()
        client.wait()
    wait(lambda: not any(runs(pid, "sweeps.child") for pid in pids_of(worker.pid)), 60)
    assert results.to_do(tmp_path, tasks) == tasks


def test_a_folder_that_workers_do_not_share(spheres, sweep, tmp_path, scheduler):
    tasks = spheres(-1)  # whose plan is not written where they look
    (problem,), _ = sweep(tasks, cluster.engine("dask", scheduler[1]))
    assert f"does not see {tmp_path}; name a folder with --out that all machines share" in problem.problem


def test_a_worker_with_two_threads_has_two_blenders(spheres, sweep, tmp_path):
    """As one starts where nobody gives --nthreads 1."""
    stands, address = standing(*SCHEDULER)
    worker, _ = standing("distributed.cli.dask_worker", address, "--nthreads", "2", *WORKER)
    try:
        tasks = spheres(-2, -1.5, -1, -0.5)
        plan.write(tmp_path, tasks)
        found = set()

        def ended(order, outcome):
            found.update(pid for pid in pids_of(worker.pid) if runs(pid, "sweeps.child"))

        assert sweep(tasks, cluster.engine("dask", address), ended)[0] == [] and len(found) == 2
        assert results.to_do(tmp_path, tasks) == []
    finally:
        end(worker, stands)


def test_a_scheduler_without_workers_is_named(tmp_path):
    """When nobody comes, and when all go away; it goes on with those that come, and ends at Ctrl-C."""
    stands, address = standing(*SCHEDULER)
    words = ("sphere", "--size", "400x300", "--samples", "4096", "--caustics", "path", "--out", tmp_path)
    start = [sys.executable, "-m", "nim_addon", "sweep", *words, "--on", f"dask={address}"]
    client = subprocess.Popen(start, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    processes = [client, stands]
    try:
        alone = (
            f"nimray: the scheduler {address} has no workers %s; it goes on as soon as there is one, such as by dask "
        )
        with within(120):
            assert client.stderr.readline().startswith(alone % "yet")
        worker, _ = standing("distributed.cli.dask_worker", address, "--nthreads", "1", *WORKER)
        processes.insert(0, worker)
        wait(lambda: (state.read(tmp_path) or {}).get("workers"), 60)  # it has begun
        end(worker)
        with within(120):
            assert client.stderr.readline().startswith(alone % "any more")
        client.send_signal(signal.SIGINT)
        assert client.wait(20) == 130
    finally:
        end(*processes)


ADAPTIVE = """
import signal, sys
from distributed import LocalCluster
if __name__ == "__main__":
    here = {"dashboard_address": "127.0.0.1:0"}
    with LocalCluster(
        n_workers=0, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, scheduler_kwargs=here,
        worker_dashboard_address="127.0.0.1:0",
    ) as cluster:
        cluster.adapt(minimum=0, maximum=2, interval="500ms", target_duration="500ms")
        print(cluster.scheduler_address, file=sys.stderr, flush=True)
        signal.pause()
"""


def test_a_cluster_that_grows_and_shrinks(spheres, sweep, tmp_path):
    """It grows with what waits, from nothing to nothing."""
    script = tmp_path / "adaptive.py"
    script.write_text(ADAPTIVE)
    process, address = standing(script, how="-u")
    tasks = spheres(*(-1 - place / 10 for place in range(8)), samples=64, size=(64, 48))
    plan.write(tmp_path, tasks)
    try:
        problems, at = sweep(tasks, cluster.engine("dask", address))
        assert problems == [] and at.done == 8 and results.to_do(tmp_path, tasks) == []
        assert len(at.record()["workers"]) == 2
        wait(lambda: not any(runs(pid, "sweeps.child") for pid in pids_of(process.pid)), 60)
    finally:
        end(process)


def test_a_worker_that_is_retired_in_its_render(spheres, sweep, tmp_path, scheduler, monkeypatch):
    """That costs no try, and no picture; it leaves at once."""
    monkeypatch.setattr(cluster, "TRIES", 1)
    _, address, retired = scheduler
    tasks = [*spheres(-3), *spheres(-2, -1.5, size=(100, 75), samples=128)]
    plan.write(tmp_path, tasks)
    others = []

    def ended(order, outcome):
        if not others:
            with distributed.Client(address, set_as_default=False) as client:
                here = list(client.nthreads())
                others.append(standing("distributed.cli.dask_worker", address, "--nthreads", "1", *WORKER)[0])
                client.wait_for_workers(2)  # which takes the results
                client.retire_workers(here)
            assert retired.wait(20) == 0

    try:
        problems, at = sweep(tasks, cluster.engine("dask", address), ended)
        assert problems == [] and at.done == 3 and results.to_do(tmp_path, tasks) == []
        assert len(at.record()["workers"]) == 2
    finally:
        end(*others)


def test_a_worker_that_goes_away_before_it_has_begun_costs_no_try(spheres, tmp_path, scheduler):
    """One fails three times, though in between another, that is stopped, was to take it."""
    _, address, _ = scheduler
    tasks = spheres(-1)
    plan.write(tmp_path, tasks)
    (tmp_path / "images").write_text("no folder")
    others, began = [], []

    class Watch(state.State):
        def began(self, name, order):
            began.append(name)
            if not others:
                words = ("--nthreads", "1", "--no-nanny", *WORKER)
                others.append(standing("distributed.cli.dask_worker", address, *words)[0])
                next(line for line in others[0].stderr if "Registered to" in line)
                others[0].send_signal(signal.SIGSTOP)
                threading.Timer(3, others[0].kill).start()

    ((_, outcome),) = cluster.engine("dask", address)([Order(tasks[0])], tmp_path, Watch(tmp_path, 1, kept=False))
    assert "images" in outcome.problem and len(began) == cluster.TRIES


@pytest.mark.skipif(not shutil.which("unshare") or os.geteuid() != 0, reason="needs mounts of its own, and root")
def test_a_worker_whose_disk_is_full(spheres, sweep, tmp_path, scheduler):
    """What it cannot write, another writes."""
    (tmp_path / "images").mkdir()
    small = ["unshare", "-m", "bash", "-c", f'mount -t tmpfs -o size=8k tmpfs {tmp_path}/images; exec "$@"', "bash"]
    words = ("distributed.cli.dask_worker", scheduler[1], "--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard")
    full, _ = standing(*words, before=small)
    try:
        tasks = spheres(*(-1 - place / 10 for place in range(8)))
        plan.write(tmp_path, tasks)
        problems, at = sweep(tasks, cluster.engine("dask", scheduler[1]))
        assert len(at.record()["workers"]) == 2
        assert (problems, at.done) == ([], 8) and results.to_do(tmp_path, tasks) == []
    finally:
        full.send_signal(signal.SIGINT)
        full.wait(20)


@pytest.mark.skipif(not shutil.which("unshare") or os.geteuid() != 0, reason="needs mounts of its own, and root")
def test_a_worker_whose_pictures_are_not_seen_here(spheres, sweep, tmp_path, monkeypatch):
    """It sees the plan, and writes into a folder that is another, though it is called the same."""
    monkeypatch.setattr(run, "PATIENCE", 1)
    (tmp_path / "images").mkdir()
    stands, address = standing(
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show"
    )
    other = ["unshare", "-m", "bash", "-c", f'mount -t tmpfs tmpfs {tmp_path}/images; exec "$@"', "bash"]
    words = ("distributed.cli.dask_worker", address, "--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard")
    apart, _ = standing(*words, before=other)
    try:
        tasks = spheres(-1)
        plan.write(tmp_path, tasks)
        (problem,), _ = sweep(tasks, cluster.engine("dask", address))
        assert f"it was rendered, but is not in {tmp_path} here" in problem.problem
    finally:
        for process in (apart, stands):
            process.send_signal(signal.SIGINT)
            process.wait(20)


SCRIPT = """
import bpy
from pathlib import Path
from nim_addon.base import signals
from nim_addon.sweeps import cluster, plan, results, run, state
folder = Path({folder!r})
tasks = plan.read(folder / "plan.jsonl")
engine = cluster.engine("dask", workers=1)
problems = run.carry_out(tasks, folder, engine, state.State(folder, 0), engine)
signals.leave(len(problems) + len(results.to_do(folder, tasks)))
"""


def test_a_script_that_imports_blender_may_have_workers_started(spheres, tmp_path):
    """Also one that does not ask whether it is the one that runs."""
    plan.write(tmp_path, spheres(-1))
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(folder=str(tmp_path)))
    subprocess.run([sys.executable, script], check=True, timeout=200, env={**os.environ, **PACKAGE})


def test_without_dask_it_says_what_to_install(spheres, sweep, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(RuntimeError, match=r"need Dask, which is not here: pip install 'nim-addon\[many\]'"):
        sweep(spheres(-1), cluster.engine("dask"))
