# SPDX-License-Identifier: GPL-3.0-or-later
"""A SLURM of two nodes on this one machine, for root: munge, a controller and two daemons, in a folder of their own."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

SETTINGS = """
ClusterName=lab
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
SlurmctldPort={ports[0]}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_min_interval=100000,bf_interval=1
MpiDefault=none
ReturnToService=2
SlurmdTimeout=300
KillWait=2
JobRequeue=1
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]} CPUs=1 RealMemory=4000 State=UNKNOWN
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]} CPUs=1 RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=60 State=UP
"""

MUNGE = (("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("seed-file", "seed"), ("log-file", "log"))


@contextlib.contextmanager
def started(folder: Path) -> Iterator[Path]:
    """Within, it runs; its settings are in folder/slurm.conf."""
    host = socket.gethostname().partition(".")[0]
    for name in ("state", "spool.n1", "spool.n2"):
        (folder / name).mkdir()
    # a munge of its own: the machine's may be about to end
    (folder / "munge.key").touch(0o600)
    (folder / "munge.key").write_bytes(os.urandom(1024))
    munge = [f"--{name}={folder}/munge.{end}" for name, end in MUNGE]
    settings = SETTINGS.format(host=host, folder=folder, ports=_free_ports(3))
    (folder / "slurm.conf").write_text(settings)
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    try:
        subprocess.run(["munged", "--force", *munge], check=True, capture_output=True)
        for words in (["slurmctld"], ["slurmd", "-N", "n1"], ["slurmd", "-N", "n2"]):
            subprocess.run([words[0], "-f", folder / "slurm.conf", *words[1:]], check=True, env=environment)
        _wait_for_nodes(environment)
        yield folder
    finally:
        for file in folder.glob("*.pid"):
            with contextlib.suppress(OSError, ValueError):
                os.kill(int(file.read_text()), signal.SIGTERM)


def _wait_for_nodes(environment):
    """Until both have told the controller of themselves."""
    until = time.monotonic() + 120
    asked = ["sinfo", "-h", "-o", "%T"]
    while subprocess.run(asked, capture_output=True, text=True, env=environment).stdout != "idle\n":
        if time.monotonic() > until:
            raise TimeoutError("the nodes of SLURM do not answer")
        time.sleep(0.1)


def _free_ports(count: int) -> list[int]:
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
