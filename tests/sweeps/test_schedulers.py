# SPDX-License-Identifier: GPL-3.0-or-later
"""Schedulers of Dask that are reached: whether they answer, in which versions, by which certificates, and from where."""

import shutil
import signal
import socket
import subprocess

import pytest

from nim_addon.sweeps import cluster, plan, results, state

from .dask_lab import standing

pytest.importorskip("distributed")
dask = pytest.importorskip("dask")
psutil = pytest.importorskip("psutil")


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
def test_a_scheduler_of_other_versions(spheres, sweep, code, told, monkeypatch):
    def waits(self, why):
        raise AssertionError(why)

    monkeypatch.setattr(state.State, "waits", waits)  # as it would, without an end, where it goes on
    process, address = stands(code)
    try:
        with pytest.raises(RuntimeError, match=told):
            sweep(spheres(-1), cluster.engine("dask", address))
    finally:
        process.kill()


# as docs/many-machines.md has them
YAML = """distributed:
  comm:
    tls:
      ca-file: {}
      client:
        cert: {}
        key: {}
"""
VARIABLES = [f"DASK_DISTRIBUTED__COMM__TLS__{name}" for name in ("CA_FILE", "CLIENT__CERT", "CLIENT__KEY")]


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

    def in_a_file(*files):
        settings = tmp_path / "dask"
        settings.mkdir(exist_ok=True)
        (settings / "nimray.yaml").write_text(YAML.format(*files))
        dask.config.refresh(paths=[settings], env={})

    def in_variables(*files):
        dask.config.refresh(paths=[], env=dict(zip(VARIABLES, files, strict=True)))

    tasks = spheres(-1, -1.5)
    plan.write(tmp_path, tasks)
    try:
        for named, certificates, told in [
            (in_a_file, ("null", "null", "null"), "wants certificates, which Dask's settings do not name"),
            (in_variables, (*ours[:2], others[2]), "cannot be read"),
            (
                in_a_file,
                others,
                "does not answer; see whether it runs there, and with certificates of the same authority",
            ),
        ]:
            named(*certificates)
            with pytest.raises(RuntimeError, match=told):
                sweep(tasks, cluster.engine("dask", address))
        for named, task in zip((in_a_file, in_variables), tasks, strict=True):
            named(*ours)
            assert sweep([task], cluster.engine("dask", address))[0] == []
        assert results.to_do(tmp_path, tasks) == []
    finally:
        dask.config.refresh()
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
    with cluster.Cluster("dask", interface=name).started(1) as here:
        assert here.scheduler_address.startswith(f"tls://{address}:")
        (own,) = here.scheduler.workers.values()
        entries = psutil.Process().net_connections("inet")
        listening = {entry.laddr.ip for entry in entries if entry.status == psutil.CONN_LISTEN}
        assert listening == {address, "127.0.0.1"} and here.scheduler.http_server.address == "127.0.0.1"
        assert own.services["dashboard"] and own.address.startswith(f"tls://{address}:")
