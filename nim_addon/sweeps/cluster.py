# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep by Dask: on this machine, by a scheduler that stands somewhere, or by jobs of a SLURM queue.

On this machine scheduler and workers are threads of this process, whose Blenders render beside it: processes of their own
would only take their time to start. Who reaches a scheduler of Dask runs code there. So one that a queue's jobs reach listens
on 127.0.0.1, without a dashboard; for others to reach it an interface must be named, and then it speaks TLS only.
"""

from __future__ import annotations

import contextlib
import importlib.util
import itertools
import json
import logging
import os
import time
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..base.files import temporary
from ..base.text import said_by
from . import queues, worker
from .children import Child, Outcome
from .orders import Engine, Order, Watch

WINDOW = 4  # orders for each worker that the scheduler knows of at a time, at least
LEAST_WINDOW = 1000  # 10 MB there; by what waits an adaptive cluster grows
TRIES = queues.TRIES  # of an order, before it is left
PATIENCE = 10  # seconds for a scheduler to answer
LOOK, AGAIN = 0.02, 1.0  # seconds between two looks whether an order has ended, and which workers are there
ALONE = 5  # seconds without any worker, after which it is said
INSTALL = "pip install 'nim-addon[many]'"


class Cluster:
    """Where orders go to: a kind of cluster, and what it needs.

    place:     "dask" or "slurm"
    address:   of a scheduler that stands, such as tls://host:8786; empty: one is started
    workers:   of a scheduler that is started here; jobs: of the queue; options: passed on to it
    interface: network interface that a scheduler of ours listens on; None: this machine's own
    mixed:     whether Blenders may be others than the plan is for
    binary:    of this machine's Blenders, as children.Child has it; first: one of them, that was started before
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
        binary: str = "",
        first: Child | None = None,
    ) -> None:
        self.place, self.address, self.workers, self.jobs = place, address, workers, jobs
        self.options, self.interface, self.mixed = list(options), interface, mixed
        self.binary, self.first = binary, first
        self.here = place == "dask" and not address

    def carry_out(self, orders: Sequence[Order], folder: Path, watch: Watch) -> Iterator[tuple[Order, Outcome]]:
        """As orders.Engine has it. Raises RuntimeError, one sentence, where the engine is not there, or goes away."""
        with _installed(), contextlib.ExitStack() as stack:
            _check_interface(self.interface)
            count, threads = min(self.workers, len(orders)), 0  # another machine's worker takes all
            if self.here:
                threads = max(1, (os.cpu_count() or 1) // count)
                stack.enter_context(self._blenders(count))
            client = stack.enter_context(self._client(folder, count))
            workers = queues.Jobs(client.cluster, self.jobs) if self.place == "slurm" else _Workers(self.address)
            yield from _through(client, orders, folder, watch, workers, threads, self.mixed)

    @contextlib.contextmanager
    def _blenders(self, count):
        """Those that workers of this process take: they start while Dask is imported."""
        children = [*([self.first] if self.first else []), *(Child(self.binary) for _ in range(count))][:count]
        with worker.lent(children):
            for child in children:
                child.start()
            yield

    @contextlib.contextmanager
    def _client(self, folder: Path, workers: int) -> Iterator[Any]:
        from distributed import Client  # pyright: ignore[reportMissingImports]

        with contextlib.ExitStack() as stack:
            where = stack.enter_context(self._cluster(folder, workers))
            if not self.address:
                yield stack.enter_context(Client(where, timeout=PATIENCE))
                return
            stack.enter_context(_silent("client"))
            with warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                client = stack.enter_context(_connected(self.address, **self._security()))
            for warning in warned:
                _check_versions(str(warning.message), self.address)
            yield client

    def _security(self) -> dict[str, Any]:
        return {"security": _own_certificates(self.address)} if self.address.startswith("tls:") else {}

    @contextlib.contextmanager
    def _cluster(self, folder, workers):
        """What a Client takes."""
        if self.address:
            yield self.address
        elif self.here:
            with self.started(workers) as cluster:
                yield cluster
        else:
            security = _certificates() if self.interface else None
            with queues.started(folder, self.jobs, self.options, self.interface or "lo", security) as cluster:
                yield cluster

    @contextlib.contextmanager
    def started(self, workers: int) -> Iterator[Any]:
        """A scheduler in this process with so many workers."""
        from distributed import LocalCluster  # pyright: ignore[reportMissingImports]

        more: dict[str, Any] = {"interface": self.interface, "security": True} if self.interface else {}
        more |= {"dashboard_address": None, "worker_dashboard_address": queues.PAGES}
        with (
            temporary() as scratch,
            _silent("batched"),  # as it ends, a message may find its other end closed
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=False,
                memory_limit=None,  # it is this process' own, in which no picture lies
                local_directory=str(scratch),
                scheduler_kwargs={"dashboard_address": queues.PAGES},
                silence_logs=50,
                **more,
            ) as cluster,
        ):
            yield cluster


class _Workers:
    """Those of this machine or of a scheduler that stands: they come and go by themselves."""

    def __init__(self, address):
        self.address = address

    def look(self):
        """Nothing is handed in for those that are gone."""

    def rendered(self):
        """Nothing comes of it."""

    def without(self, ever):
        """A sentence: there is no worker; ever: whether there was one."""
        what = "any more" if ever else "yet"
        return (
            f"the scheduler {self.address} has no workers {what}; it goes on as soon as there is one, such as by "
            f"dask worker {self.address} --nthreads 1."
        )


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


@contextlib.contextmanager
def _silent(part):
    """Within, that part of Dask writes no tracebacks of its own: a sentence says what went wrong, or nothing did."""
    log = logging.getLogger(f"distributed.{part}")
    former = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(former)


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
        raise RuntimeError(
            f"{told}, and those of Dask's settings, {', '.join(names)}, cannot be read: {reason}."
        ) from None
    return security


def _certificates():
    from distributed.security import Security  # pyright: ignore[reportMissingImports]

    return Security.temporary()


def _check_interface(name):
    import psutil  # pyright: ignore[reportMissingImports, reportMissingModuleSource]

    if name is None:
        return
    if name not in (known := psutil.net_if_addrs()):
        raise RuntimeError(f"there is no network interface {name!r} here; the ones that exist are {', '.join(known)}.")
    if not importlib.util.find_spec("cryptography"):
        raise RuntimeError(f"--interface needs certificates, which cryptography makes: {INSTALL}.")


def _connected(address, **security):
    """A Client of a scheduler that stands; RuntimeError, one sentence, where it cannot be."""
    from distributed import Client  # pyright: ignore[reportMissingImports]

    try:
        return Client(address, timeout=PATIENCE, **security)
    except OSError as error:
        certificates = ", and with certificates of the same authority" if security else ""
        raise RuntimeError(
            f"the scheduler {address} does not answer; see whether it runs there{certificates}."
        ) from error
    except Exception as error:  # anything, where it speaks otherwise
        raise RuntimeError(
            f"the scheduler {address} is not understood; see whether it is one of Dask, in the version that is here: "
            f"{said_by(error)}."
        ) from error


def _check_versions(said, address):
    """Raise RuntimeError, one sentence, where Dask says in a table that scheduler or workers have others."""
    if "Mismatched versions" not in said:
        return
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in said.splitlines() if line[:1] == "|"]
    told = ", ".join(
        f"{name} ({here} here, {there} there, workers {workers})" for name, here, there, workers in rows[1:]
    )
    raise RuntimeError(
        f"the scheduler {address} or its workers have other versions than this machine: {told}; install the same everywhere."
    )


class _Flight:
    """The orders that a client of Dask has sent, some at a time."""

    def __init__(self, client, folder, threads, mixed):
        self.client, self.record = client, {"folder": folder, "threads": threads, "mixed": mixed}
        self.sent = itertools.count()
        self.tries: dict[str, list[str]] = {}  # of each order's key, the addresses of workers
        self.flying: dict[Any, Order] = {}  # by its future
        self.bound: dict[Any, list[str]] = {}  # futures that only these workers may take
        self.workers: set[str] = set()  # their addresses, as they were a moment ago
        self.look()

    def look(self):
        """Which workers are there; a scheduler that is gone is not asked, which would take long."""
        if self.client.status == "running":
            with contextlib.suppress(OSError):
                self.workers = set(self.client.nthreads())

    def send(self, order):
        been = self.tries.setdefault(order.task.key, [])
        if been:
            self.look()
        # again with another one, if there is: the disk of this one may be full
        others = [address for address in self.workers if address not in been] if been else []
        future = self.client.submit(
            worker.carry_out,
            json.dumps(order.record(**self.record)),
            pure=False,
            # by the word before the dash Dask learns what an order takes, and an adaptive cluster how many workers it is to have
            key=f"render-{order.task.key}-{next(self.sent)}",
            workers=others or None,
        )
        self.flying[future] = order
        if others:
            self.bound[future] = others
        return future

    def some(self, waiting):
        """As many of those that wait as there is room for, sent."""
        room = max(LEAST_WINDOW, WINDOW * len(self.workers)) - len(self.flying)
        return [self.send(order) for _, order in zip(range(room), waiting, strict=False)]

    def lost(self):
        """Those that wait for workers that are gone, all, sent to any."""
        return [self._anew(future) for future, others in list(self.bound.items()) if not self.workers & set(others)]

    def _anew(self, future):
        order = self.landed(future)
        assert order
        future.cancel()
        return self.send(order)

    def landed(self, future):
        """The order of a future that has ended; None where it has been sent anew."""
        self.bound.pop(future, None)
        return self.flying.pop(future, None)


class _Alone:
    """Says when there are no workers for a while: once, and anew when those are gone that came, or others are awaited."""

    def __init__(self, watch, sentence):
        self.watch, self.sentence = watch, sentence
        self.since, self.said, self.ever = time.monotonic(), "", False

    def look(self, workers):
        if workers:
            self.came()
        elif time.monotonic() - self.since > ALONE and (sentence := self.sentence(self.ever)) != self.said:
            self.said = sentence
            self.watch.waits(sentence)

    def came(self):
        self.since, self.said, self.ever = time.monotonic(), "", True


def _through(client, orders, folder, watch, workers, threads, mixed):
    """Send orders through a client of Dask, and yield them as they end; workers: a queue's Jobs, or _Workers."""
    from distributed import as_completed  # pyright: ignore[reportMissingImports]

    known = {order.task.key: order for order in orders}

    def hear(event):
        said = event[1] if isinstance(event, tuple) else event
        if isinstance(said, dict) and (order := known.get(said.get("key", ""))):
            alone.came()
            if said["total"]:
                watch.goes_on(f"worker {said['name']}", order, said["done"], said["total"])
            else:
                watch.began(f"worker {said['name']}", order)

    alone = _Alone(watch, workers.without)
    client.subscribe_topic(worker.TOPIC, hear)
    waiting, flight = iter(orders), _Flight(client, folder, threads, mixed)

    def look():
        flight.look()
        alone.look(flight.workers)
        workers.look()
        return flight.lost()

    ended = as_completed(flight.some(waiting))
    for future in _each(ended, look):
        order = flight.landed(future)
        if order is None:
            continue
        outcome, where = _outcome(future, order)
        been = flight.tries[order.task.key]
        been.append(where)
        if outcome.problem and outcome.again and len(been) < TRIES:
            ended.add(flight.send(order))
            continue
        workers.rendered()
        ended.update(flight.some(waiting))
        yield order, outcome


def _each(ended, more):
    """The futures of an as_completed as they end, with those that more() gives now and then."""
    until = time.monotonic() + AGAIN
    while not ended.is_empty():
        while not ended.has_ready() and time.monotonic() < until:
            time.sleep(LOOK)
        if time.monotonic() >= until:
            ended.update(more())
            until = time.monotonic() + AGAIN
        if ended.has_ready():
            yield next(ended)


def _outcome(future, order):
    if future.status == "cancelled":
        raise RuntimeError("the scheduler is gone; what is done is kept, and the same command goes on from there.")
    if future.status == "error":
        return Outcome(order.task.key, 0.0, f"Dask has given it up: {said_by(future.exception())}"), ""
    said = json.loads(future.result())
    return Outcome(*(said[field] for field in Outcome._fields)), said["worker"]
