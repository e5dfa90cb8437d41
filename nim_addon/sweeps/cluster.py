# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep by Dask: on this machine, by a scheduler that stands somewhere, or by jobs of a SLURM queue.

Who reaches a scheduler of Dask runs code there. So one of ours listens on 127.0.0.1, without a dashboard; for others to
reach it an interface must be named, and then it speaks TLS only.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from . import export, worker
from .children import Outcome
from .orders import Engine, Order, Watch

WINDOW = 4  # orders for each worker that the scheduler knows of at a time, at least
LEAST_WINDOW = 64
TRIES = 3  # of an order, before it is left
PATIENCE = 10  # seconds for a scheduler to answer
LOOK, AGAIN = 0.02, 5.0  # seconds between two looks whether an order has ended, and whether workers are still there
LOCAL = "127.0.0.1"
INSTALL = "pip install 'nim-addon[many]'"


class Cluster:
    """Where orders go to: a kind of cluster, and what it needs.

    place:     "dask" or "slurm"
    address:   of a scheduler that stands, such as tls://host:8786; empty: one is started
    workers:   of a scheduler that is started here; jobs: of the queue; options: passed on to it
    interface: network interface that a scheduler of ours listens on; None: 127.0.0.1
    mixed:     whether Blenders may be others than the plan is for
    """

    def __init__(
        self,
        place: str,
        address: str = "",
        *,
        workers: int = 2,
        jobs: int = 2,
        options: Sequence[str] = (),
        interface: str | None = None,
        mixed: bool = False,
    ) -> None:
        self.place, self.address, self.workers, self.jobs = place, address, workers, jobs
        self.options, self.interface, self.mixed = list(options), interface, mixed

    def carry_out(self, orders: Sequence[Order], folder: Path, watch: Watch) -> Iterator[tuple[Order, Outcome]]:
        """As orders.Engine has it. Raises RuntimeError, one sentence, where the engine is not there, or goes away."""
        with _installed(), contextlib.ExitStack() as stack:
            _check_interface(self.interface)
            client = stack.enter_context(self._client(folder))
            yield from _through(client, orders, folder, watch, self._threads(), self.mixed)

    def _threads(self):
        """Of each Blender: this machine's are shared among its workers, another's are that worker's own affair."""
        return max(1, (os.cpu_count() or 1) // self.workers) if self.place == "dask" and not self.address else 0

    @contextlib.contextmanager
    def _client(self, folder: Path) -> Iterator[Any]:
        from distributed import Client  # pyright: ignore[reportMissingImports]

        with contextlib.ExitStack() as stack:
            where = stack.enter_context(self._cluster(folder))
            try:
                client = stack.enter_context(Client(where, timeout=PATIENCE, **self._security()))
            except OSError as error:
                certificates = ", and with certificates of the same authority" if self.address[:4] == "tls:" else ""
                raise RuntimeError(
                    f"the scheduler {self.address} does not answer; see whether it runs there{certificates}."
                ) from error
            if self.address:
                _check_versions(client, self.address)
            yield client

    def _security(self) -> dict[str, Any]:
        return {"security": _own_certificates(self.address)} if self.address.startswith("tls:") else {}

    @contextlib.contextmanager
    def _cluster(self, folder):
        """What a Client takes."""
        if self.address:
            yield self.address
        elif self.place == "dask":
            with self._here() as cluster:
                yield cluster
        else:
            with self._queue(folder) as cluster:
                yield cluster

    @contextlib.contextmanager
    def _here(self):
        from distributed import LocalCluster  # pyright: ignore[reportMissingImports]

        more: dict[str, Any] = {"interface": self.interface, "security": True} if self.interface else {"host": LOCAL}
        # its pages, which anybody may read, are for this machine, at any port
        more |= {"dashboard_address": None, "scheduler_kwargs": {"dashboard_address": f"{LOCAL}:0"}, "silence_logs": 50}
        _blender_before_its_scripts()
        with contextlib.ExitStack() as stack:
            try:
                cluster = LocalCluster(n_workers=self.workers, threads_per_worker=1, **more)
            except RuntimeError as error:
                raise RuntimeError(
                    "the workers of Dask do not start; a script that has them started needs if __name__ == '__main__': "
                    "before all that it does, as they import it."
                ) from error
            yield stack.enter_context(cluster)

    @contextlib.contextmanager
    def _queue(self, folder):
        from dask_jobqueue.slurm import SLURMCluster  # pyright: ignore[reportMissingImports]

        shared = Path(folder) / ".queue"
        shared.mkdir(exist_ok=True)
        security = {"security": _certificates(), "shared_temp_directory": str(shared)} if self.interface else {}
        with SLURMCluster(
            cores=1,
            processes=1,
            memory="2GB",
            nanny=True,
            interface=self.interface or "lo",
            python=sys.executable,
            local_directory=tempfile.gettempdir(),
            log_directory=str(shared),
            job_script_prologue=export.prologue(),
            job_extra_directives=self.options,
            scheduler_options={"dashboard_address": None},
            **security,
        ) as cluster:
            check_queue(cluster.job_script())
            cluster.scale(jobs=self.jobs)
            yield cluster


def engine(place: str, address: str = "", **options) -> Engine:
    """The engine of a Cluster, whose options are as there."""
    return Cluster(place, address, **options).carry_out


@contextlib.contextmanager
def _installed():
    try:
        yield
    except ImportError as error:
        raise RuntimeError(
            f"--on dask and --on slurm need Dask, which is not here: {INSTALL} ({error.name})."
        ) from None


def _blender_before_its_scripts():
    """Let processes that take over sys.path find Blender, before what is called bpy, too, among its own scripts."""
    if "bpy" in sys.modules:
        import bpy

        scripts = bpy.utils.system_resource("SCRIPTS")
        sys.path.sort(key=lambda entry: entry.startswith(scripts))


def _own_certificates(address):
    """Those that a person names in Dask's settings; RuntimeError, one sentence, where they are none."""
    from distributed import Security  # pyright: ignore[reportMissingImports]

    security = Security()
    names = (security.tls_ca_file, security.tls_client_cert, security.tls_client_key)
    told = f"the scheduler {address} wants certificates"
    if not all(names):
        raise RuntimeError(
            f"{told}, which Dask's settings do not name: distributed.comm.tls.ca-file, .client.cert and .client.key."
        )
    try:
        security.get_connection_args("client")
    except OSError as error:  # also of what is no certificate
        reason = error.strerror or error
        raise RuntimeError(f"{told}, and those of Dask's settings, {', '.join(names)}, cannot be read: {reason}.") from None
    return security


def _certificates():
    from distributed.security import Security  # pyright: ignore[reportMissingImports]

    return Security.temporary()


def _check_interface(name):
    import psutil  # pyright: ignore[reportMissingImports, reportMissingModuleSource]

    if name is not None and name not in (known := psutil.net_if_addrs()):
        raise RuntimeError(f"there is no network interface {name!r} here; the ones that exist are {', '.join(known)}.")


def _check_versions(client, address):
    try:
        client.get_versions(check=True)
    except ValueError as error:
        told = " ".join(str(error).split())
        raise RuntimeError(f"the scheduler {address} has other versions than this machine: {told}") from None


def check_queue(script: str) -> None:
    """Raise RuntimeError, one sentence, where the queue would not take the job."""
    try:
        asked = subprocess.run(
            ["sbatch", "--test-only"], input=script, capture_output=True, text=True, timeout=60, check=False
        )
    except FileNotFoundError:
        raise RuntimeError("there is no sbatch here; run this on a machine that hands jobs to SLURM.") from None
    if asked.returncode:
        raise RuntimeError(f"the queue refuses the job: {' '.join(asked.stderr.split())}")


class _Flight:
    """The orders that a client of Dask has sent, some at a time."""

    def __init__(self, client, folder, threads, mixed):
        self.client, self.record = client, {"folder": folder, "threads": threads, "mixed": mixed}
        self.tries: dict[str, list[str]] = {}  # of each order's key, the addresses of workers
        self.flying: dict[Any, Order] = {}  # by its future
        self.bound: dict[Any, list[str]] = {}  # futures that only these workers may take

    def send(self, order):
        been = self.tries.setdefault(order.task.key, [])
        # again with another one, if there is: the disk of this one may be full
        others = [address for address in self.client.nthreads() if address not in been] if been else []
        future = self.client.submit(
            worker.carry_out,
            json.dumps(order.record(**self.record)),
            pure=False,
            key=f"{order.task.key}/{len(been)}",
            workers=others or None,
        )
        self.flying[future] = order
        if others:
            self.bound[future] = others
        return future

    def some(self, waiting):
        """As many of those that wait as there is room for, sent."""
        room = max(LEAST_WINDOW, WINDOW * len(self.client.scheduler_info()["workers"])) - len(self.flying)
        return [self.send(order) for _, order in zip(range(room), waiting, strict=False)]

    def lost(self):
        """Those that wait for workers that are gone, all, sent to any."""
        here = set(self.client.nthreads()) if self.bound else set()
        return [self._anew(future) for future, others in list(self.bound.items()) if not here & set(others)]

    def _anew(self, future):
        order = self.landed(future)
        assert order
        self.tries[order.task.key].append("")  # so that it is another key
        future.cancel()
        return self.send(order)

    def landed(self, future):
        """The order of a future that has ended; None where it has been sent anew."""
        self.bound.pop(future, None)
        return self.flying.pop(future, None)


def _through(client, orders, folder, watch, threads, mixed):
    """Send orders through a client of Dask, and yield them as they end."""
    from distributed import as_completed  # pyright: ignore[reportMissingImports]

    known = {order.task.key: order for order in orders}

    def hear(event):
        said = event[1] if isinstance(event, tuple) else event
        if isinstance(said, dict) and (order := known.get(said.get("key", ""))):
            if said["total"]:
                watch.goes_on(f"worker {said['worker']}", order, said["done"], said["total"])
            else:
                watch.began(f"worker {said['worker']}", order)

    client.subscribe_topic(worker.TOPIC, hear)
    waiting, flight = iter(orders), _Flight(client, folder, threads, mixed)
    ended = as_completed(flight.some(waiting))
    for future in _each(ended, flight.lost):
        order = flight.landed(future)
        if order is None:
            continue
        outcome, where = _outcome(future, order)
        been = flight.tries[order.task.key]
        been.append(where)
        if outcome.problem and outcome.again and len(been) < TRIES:
            ended.add(flight.send(order))
            continue
        ended.update(flight.some(waiting))
        yield order, outcome


def _each(ended, more):
    """The futures of an as_completed as they end, with those that more() gives now and then."""
    while not ended.is_empty():
        until = time.monotonic() + AGAIN
        while not ended.has_ready() and time.monotonic() < until:
            time.sleep(LOOK)
        if ended.has_ready():
            yield next(ended)
        else:
            ended.update(more())


def _outcome(future, order):
    if future.status == "cancelled":
        raise RuntimeError("the scheduler is gone; what is done is kept, and the same command goes on from there.")
    if future.status == "error":
        told = " ".join(str(future.exception()).split())
        return Outcome(order.task.key, 0.0, f"the worker that rendered it went away: {told}"), ""
    said = json.loads(future.result())
    return Outcome(*(said[field] for field in Outcome._fields)), said["worker"]
