# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep by Dask and by SLURM, the real ones: also when workers, schedulers and jobs are killed."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nim_addon.sweeps import cluster, export, plan, results, run

distributed = pytest.importorskip("distributed")
dask = pytest.importorskip("dask")
psutil = pytest.importorskip("psutil")
ROOT = Path(__file__).parents[2]
PACKAGE = {"PYTHONPATH": str(ROOT)}
ENVIRONMENT = {**os.environ, **PACKAGE}


def standing(*words, before=(), protocol="tcp", how="-m"):
    """A process of Dask, and the address that it says it listens on; `before`: words that start it."""
    process = subprocess.Popen(
        [*before, sys.executable, how, *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, **PACKAGE},
    )
    for line in process.stderr:
        if f"{protocol}://" in line:
            return process, f"{protocol}://" + line.rpartition(f"{protocol}://")[2].strip()
    raise AssertionError("it ended")


@pytest.fixture
def scheduler():
    """A scheduler that stands, with one worker: (its process, its address, the worker's process)."""
    stands, address = standing(
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show"
    )
    worker, _ = standing(
        "distributed.cli.dask_worker", address, "--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard"
    )
    yield stands, address, worker
    for process in (worker, stands):
        process.send_signal(signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()


def pids_of(pid):
    """The processes that a process has started, and those that these have, by /proc."""
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            found += [int(child), *pids_of(child)]
    return list(dict.fromkeys(found))


def test_dask_on_this_machine(spheres, sweep, tmp_path):
    tasks = spheres(-2, -1.5, -1)
    plan.write(tmp_path, tasks)
    problems, at = sweep(tasks, cluster.engine("dask"))
    assert (problems, at.done) == ([], 3) and results.to_do(tmp_path, tasks) == []
    assert len(at.record()["workers"]) == 2


def test_a_worker_that_is_killed_in_a_render(spheres, sweep, tmp_path, scheduler):
    """It is started anew by its nanny, and what it rendered is rendered again."""
    _, address, worker = scheduler
    tasks = spheres(-2, -1.5, -1, samples=16)
    plan.write(tmp_path, tasks)
    killed = []

    def ended(order, outcome):
        if not killed:
            for pid in pids_of(worker.pid):  # the worker that the nanny has started, and its Blender
                if _runs(pid, "sweeps.child") or _runs(pid, "spawn_main"):
                    killed.append(pid)
                    os.kill(pid, signal.SIGKILL)

    problems, at = sweep(tasks, cluster.engine("dask", address), ended)
    assert len(killed) == 2 and problems == [] and at.done == 3 and results.to_do(tmp_path, tasks) == []


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
        wait(lambda: any(_runs(pid, "sweeps.child") for pid in pids_of(worker.pid)), 60)
        time.sleep(1)
    finally:
        client.kill()
        client.wait()
    wait(lambda: not any(_runs(pid, "sweeps.child") for pid in pids_of(worker.pid)), 60)
    assert results.to_do(tmp_path, tasks) == tasks


def _runs(pid, words):
    try:
        return words in Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return False


def wait(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_a_scheduler_that_does_not_answer(spheres, sweep, monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", 1)
    with pytest.raises(RuntimeError, match=r"the scheduler tcp://127.0.0.1:9 does not answer"):
        sweep(spheres(-1), cluster.engine("dask", "tcp://127.0.0.1:9"))


def stands(code):
    """A scheduler of Dask that Python code has changed before, within `with`: its address."""
    words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show"]
    run = f"import sys; {code}; sys.argv[1:] = {words}; from distributed.cli.dask_scheduler import main; main()"
    return standing(run, how="-c")


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (
            "import distributed.versions as v; v._version_cached = lambda package, former=v._version_cached: "
            "'1.0' if package == 'toolz' else former(package)",
            r"or its workers have other versions than this machine: toolz \([\d.]+ here, 1.0 there, workers None\); install",
        ),
        (
            "import distributed; distributed.Scheduler.identity = lambda self: {}",
            "is not understood; see whether it is one of Dask, in the version that is here: .*unexpected keyword",
        ),
    ],
    ids=["of a package", "of Dask"],
)
def test_a_scheduler_of_other_versions(spheres, sweep, code, told):
    process, address = stands(code)
    try:
        with pytest.raises(RuntimeError, match=told):
            sweep(spheres(-1), cluster.engine("dask", address))
    finally:
        process.kill()


def test_a_folder_that_workers_do_not_share(spheres, sweep, tmp_path, scheduler):
    tasks = spheres(-1)  # whose plan is not written where they look
    (problem,), _ = sweep(tasks, cluster.engine("dask", scheduler[1]))
    assert f"does not see {tmp_path}; name a folder with --out that all machines share" in problem.problem


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


@pytest.mark.skipif(not shutil.which("openssl"), reason="needs openssl, which makes certificates")
def test_a_scheduler_with_certificates_of_ones_own(spheres, sweep, tmp_path):
    """They are those of Dask's settings; without them, or with others, it is said."""
    ours, others = (_certificates(tmp_path / who) for who in ("ours", "others"))
    words = [
        word for name, file in zip(("ca-file", "cert", "key"), ours, strict=True) for word in (f"--tls-{name}", file)
    ]
    stands, address = standing(
        *("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show"),
        *("--protocol", "tls", *words),
        protocol="tls",
    )
    worker, _ = standing(
        *("distributed.cli.dask_worker", address, "--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard", *words),
        protocol="tls",
    )

    def with_certificates(authority, certificate, key):
        tls = {"ca-file": authority, "client.cert": certificate, "client.key": key}
        with dask.config.set({f"distributed.comm.tls.{name}": file for name, file in tls.items()}):
            return sweep(tasks, cluster.engine("dask", address))

    tasks = spheres(-1)
    plan.write(tmp_path, tasks)
    try:
        for certificates, told in [
            ((None, None, None), "wants certificates, which Dask's settings do not name"),
            ((*ours[:2], others[2]), "cannot be read"),
            (others, "does not answer; see whether it runs there, and with certificates of the same authority"),
        ]:
            with pytest.raises(RuntimeError, match=told):
                with_certificates(*certificates)
        assert with_certificates(*ours)[0] == [] and results.to_do(tmp_path, tasks) == []
    finally:
        for process in (worker, stands):
            process.send_signal(signal.SIGINT)
            process.wait(20)


def _certificates(folder):
    """The certificate of an authority of its own, and one by it with its key: files."""
    folder.mkdir()

    def openssl(*words):
        subprocess.run(["openssl", *words], check=True, capture_output=True, cwd=folder)

    new = ("-newkey", "rsa:2048", "-nodes", "-subj")
    openssl("req", "-x509", *new, "/CN=authority", "-keyout", "ca.key", "-out", "ca.pem")
    openssl("req", *new, "/CN=machine", "-keyout", "own.key", "-out", "own.csr")
    openssl(
        *("x509", "-req", "-in", "own.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-out", "own.pem")
    )
    return tuple(str(folder / name) for name in ("ca.pem", "own.pem", "own.key"))


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


def test_a_network_interface_that_is_not_there(spheres, sweep):
    for place in ("dask", "slurm"):
        with pytest.raises(RuntimeError, match=r"there is no network interface 'none0' here; the ones .*lo"):
            sweep(spheres(-1), cluster.engine(place, interface="none0"))


def test_the_pages_of_a_scheduler_are_for_this_machine():
    """Of one that others reach, too; what anybody may read there is not for them."""
    pytest.importorskip("cryptography")
    found = {
        name: address.address
        for name, addresses in psutil.net_if_addrs().items()
        for address in addresses
        if address.family == socket.AF_INET and not address.address.startswith("127.")
    }
    if not found:
        pytest.skip("needs a network")
    name, address = next(iter(found.items()))
    with cluster.Cluster("dask", workers=1, interface=name).here() as here:
        assert here.scheduler_address.startswith(f"tls://{address}:")
        (own,) = here.scheduler.workers.values()
        workers = [psutil.Process(pid) for pid in pids_of(os.getpid()) if _runs(pid, "spawn_main")]
        listening = {
            entry.laddr.ip
            for process in (psutil.Process(), *workers)
            for entry in process.net_connections("inet")
            if entry.status == psutil.CONN_LISTEN
        }
        assert listening == {address, "127.0.0.1"} and here.scheduler.http_server.address == "127.0.0.1"
        assert own.services["dashboard"] and own.address.startswith(f"tls://{address}:")


def test_without_dask_it_says_what_to_install(spheres, sweep, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(RuntimeError, match=r"need Dask, which is not here: pip install 'nim-addon\[many\]'"):
        sweep(spheres(-1), cluster.engine("dask"))


# ------------------------------------------------------------------------------------------------ queues


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


def test_a_queue_that_refuses_the_job(spheres, sweep, queue):
    pytest.importorskip("dask_jobqueue")
    with pytest.raises(RuntimeError, match=r"the queue refuses the job: .*artition"):
        sweep(spheres(-1), cluster.engine("slurm", options=["--partition=none"]))


def test_a_machine_without_a_queue(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(RuntimeError, match="there is no sbatch here"):
        cluster.check_queue("#!/bin/bash\n")


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
    (file,) = export.write("openjd", tmp_path, tasks, chunk=2)
    template = json.loads(file.read_text())
    lines = template["steps"][0]["parameterSpace"]["taskParameterDefinitions"][0]
    assert (lines["range"], lines["chunks"]["defaultTaskCount"]) == ("1-3", 2)
    openjd = Path(sys.executable).with_name("openjd")
    if not openjd.exists():
        pytest.skip("needs openjd-cli")
    done = subprocess.run([openjd, "run", file, "--run-dependencies"], capture_output=True, text=True, env=ENVIRONMENT)
    assert done.returncode == 0, done.stdout[-3000:]
    assert "Chunks run: 3" in done.stdout  # two of tasks, and what puts all together
    assert results.to_do(tmp_path, tasks) == []
    assert (tmp_path / "table.csv").is_file()
