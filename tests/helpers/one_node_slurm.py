"""A real SLURM on this machine alone, its files in one folder, for as long as a test needs it."""

import contextlib
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "sinfo")
CONFIGURATION = """ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={control}
SlurmdPort={node}
AuthInfo=socket={folder}/munge.socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory=8000
PartitionName=cpu Nodes=ALL Default=YES State=UP
"""


def _path() -> str:
    """Where commands are looked for; those of SLURM's daemons are with the system's."""
    return f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"


def missing() -> str:
    """Why there is no SLURM to be had here; empty where there is."""
    absent = [name for name in PROGRAMS if not shutil.which(name, path=_path())]
    if absent:
        return f"{', '.join(absent)} absent: apt-get install slurm-wlm munge"
    return "" if os.geteuid() == 0 else "slurmd starts jobs as root only"


@contextlib.contextmanager
def slurm(folder: Path) -> Iterator[dict[str, str]]:
    """Start it; gives the environment in which its commands find it. Raises TimeoutError (see ``log`` there)."""
    for name in ("state", "spool"):
        (folder / name).mkdir(parents=True)
    host = socket.gethostname().split(".")[0]
    control, node = _free_ports(2)
    text = CONFIGURATION.format(host=host, folder=folder, control=control, node=node, cores=os.cpu_count() or 1)
    (folder / "slurm.conf").write_text(text)
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    environment = dict(os.environ, SLURM_CONF=str(folder / "slurm.conf"), PATH=_path())
    files = [f"--{name}={folder / f'munge.{name.split(chr(45))[0]}'}" for name in ("socket", "pid-file", "log-file")]
    seed = f"--seed-file={folder / 'munge.seed'}"
    commands = [["munged", "-F", "--force", f"--key-file={key}", *files, seed], ["slurmctld", "-D"], ["slurmd", "-D"]]
    running = []
    try:
        with (folder / "log").open("w") as log:
            for command in commands:
                running.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log))
                wait((folder / "munge.socket").exists)
            wait(lambda: _idle(environment))
        yield environment
    finally:
        with contextlib.suppress(subprocess.TimeoutExpired):  # where the controller has not started
            subprocess.run(["scancel", "--user=root"], env=environment, capture_output=True, timeout=60)
        for process in reversed(running):
            process.terminate()
        for process in running:
            process.wait(60)


def _idle(environment: dict[str, str]) -> bool:
    said = subprocess.run(["sinfo", "-h", "-o", "%t"], env=environment, capture_output=True, text=True, timeout=60)
    return said.stdout.strip() == "idle"


def wait(ready: Callable[[], bool], most: float = 300.0) -> None:
    """Until something is so; raises TimeoutError after ``most`` s."""
    until = time.monotonic() + most
    while not ready():
        if time.monotonic() > until:
            raise TimeoutError(f"not ready after {most:g} s")
        time.sleep(0.2)


def _free_ports(count: int) -> list[int]:
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]
