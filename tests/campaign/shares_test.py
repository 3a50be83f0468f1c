"""10,000 cases give the same table in whatever way they are shared out: by one process, two, seven shards, a process that
is killed 50 times, and a job array of Slurm on this machine with 20 tasks of which some are killed.

Slurm needs root, because slurmd starts processes of other users. The test starts munged, slurmctld and slurmd in a
temporary folder, on ports of their own, and ends them.
"""

import os
import random
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

BIN = os.environ["FREEFLEX_BIN"]
CASES = 10_000

SCENE = """
points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]
links: {name: s, spring: [a, b], stiffness: 50}
initial: {points: {a: {displacement: [-0.001, 0, 0]}, b: {displacement: [0.001, 0, 0]}}}
"""
CAMPAIGN = f"""
scene: pair.yaml
cases: {CASES}
until: 5
vary:
  - {{name: k, path: links.s.stiffness, lognormal: {{median: 50, log_sd: 0.2}}}}
measure: {{of: point.b.dx, take: final}}
"""
CONF = """
ClusterName=freeflex
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmdPort={slurmd_port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=20
MaxArraySize=1001
JobRequeue=1
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class Shares(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder, cls.environment, cls.processes = folder.name, os.environ, []
        for name, text in (("pair.yaml", SCENE), ("c.yaml", CAMPAIGN)):
            cls.write(name, text)
        cls.random = random.Random(1)
        alone = cls.campaign("run", "alone", "--jobs", "1")
        assert alone.returncode == 0, alone.stderr
        cls.table = cls.table_of("alone")

    @classmethod
    def write(cls, name, text):
        with open(f"{cls.folder}/{name}", "w") as file:
            file.write(text)

    @classmethod
    def table_of(cls, out):
        with open(f"{cls.folder}/{out}/cases.csv") as file:
            return file.read()

    @classmethod
    def command(cls, *words):
        return subprocess.run(words, env=cls.environment, cwd=cls.folder, capture_output=True, text=True)

    @classmethod
    def campaign(cls, what, out, *words):
        return cls.command(f"{BIN}/freeflex", "campaign", what, "c.yaml", "--out", out, *words)

    def test_two_processes(self):
        self.assertEqual(self.campaign("run", "two", "--jobs", "2").returncode, 0)
        self.assertEqual(self.table_of("two"), self.table)

    def test_seven_shards(self):
        for shard in self.random.sample(range(7), 7):
            self.assertEqual(self.campaign("run", "seven", "--shard", f"{shard}/7").returncode, 0)
        self.assertEqual(self.campaign("merge", "seven").returncode, 0)
        self.assertEqual(self.table_of("seven"), self.table)

    @classmethod
    def bytes_of(cls, out):
        """Returns the size of the results that the processes of a campaign have appended."""
        try:
            parts = [entry.path for entry in os.scandir(f"{cls.folder}/{out}") if entry.name.startswith("part-")]
        except FileNotFoundError:
            return 0
        return sum(os.path.getsize(path) for path in parts)

    def test_fifty_kills(self):
        # by the cases that are done, because their time depends on the machine
        moments = sorted(self.random.uniform(0.0, 0.9) * self.bytes_of("alone") for _ in range(50))
        for kill, moment in enumerate(moments):
            with subprocess.Popen([f"{BIN}/freeflex", "campaign", "run", "c.yaml", "--out", "killed", "--jobs", "1"],
                                  cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                time.sleep(self.random.uniform(0.01, 0.1))
                while process.poll() is None and self.bytes_of("killed") < moment:
                    time.sleep(0.001)
                self.assertIsNone(process.poll(), f"the campaign ended before kill {kill}")
                process.kill()
        ended = self.campaign("run", "killed")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertEqual(self.table_of("killed"), self.table)

    def start_slurm(self):
        for program in ("munged", "slurmctld", "slurmd", "sbatch"):
            if not shutil.which(program, path=os.environ["PATH"] + ":/usr/sbin"):
                self.skipTest(f"{program} is not installed (tools/install-packages all)")
        if os.geteuid() != 0:
            self.skipTest("slurmd needs root")
        self.addCleanup(self.end_all)
        host = subprocess.run(["hostname", "-s"], capture_output=True, text=True, check=True).stdout.strip()
        port = 20000 + os.getpid() % 20000
        self.write("slurm.conf", CONF.format(host=host, folder=self.folder, port=port, slurmd_port=port + 1))
        os.makedirs(f"{self.folder}/state")
        os.makedirs(f"{self.folder}/spool")
        with open(f"{self.folder}/munge.key", "wb") as key:
            key.write(os.urandom(128))
        os.chmod(f"{self.folder}/munge.key", 0o400)
        type(self).environment = os.environ | {"SLURM_CONF": f"{self.folder}/slurm.conf",
                                               "PATH": os.environ["PATH"] + ":/usr/sbin"}
        self.start("munged", "--foreground", "--force", f"--key-file={self.folder}/munge.key",
                   f"--socket={self.folder}/munge.socket", f"--pid-file={self.folder}/munge.pid",
                   f"--log-file={self.folder}/munge.log", f"--seed-file={self.folder}/munge.seed")
        self.wait_for(lambda: os.path.exists(f"{self.folder}/munge.socket"))
        self.start("slurmctld", "-D")
        self.slurmd = self.start("slurmd", "-D", "-N", host)
        self.wait_for(lambda: "idle" in self.command("sinfo", "-h", "-o", "%T").stdout)

    def start(self, *words):
        process = subprocess.Popen(words, env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.processes.append(process)
        return process

    def end_all(self):
        for process in reversed(self.processes):
            process.terminate()
            try:
                process.wait(timeout=20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def wait_for(self, is_so, seconds=60):
        end = time.monotonic() + seconds
        while not is_so():
            self.assertLess(time.monotonic(), end, self.logs())
            time.sleep(0.2)

    def logs(self):
        text = ""
        for name in ("slurmctld.log", "slurmd.log", "munge.log"):
            if os.path.exists(f"{self.folder}/{name}"):
                with open(f"{self.folder}/{name}") as file:
                    text += file.read()[-3000:]
        return text

    def submit(self):
        submitted = self.campaign("slurm", "array", "--tasks", "20", "--submit")
        self.assertEqual(submitted.returncode, 0, submitted.stderr)
        return submitted.stdout.split(",")[0].split()[1]

    def end_of(self, job):
        self.wait_for(lambda: not self.command("squeue", "-h", "-j", job).stdout.strip(), 600)

    def test_an_array_of_twenty_tasks_of_slurm(self):
        self.start_slurm()
        job = self.submit()
        self.assertIn("Slurm: 1 job, tasks: ", self.campaign("status", "array").stdout)
        # some tasks are put back into the queue, as after the loss of their node, and others are killed
        killed = 0
        while killed < 5:
            time.sleep(self.random.uniform(0.2, 1.0))
            self.assertTrue(self.command("squeue", "-h", "-j", job).stdout.strip(), "the array ended before all kills")
            tasks = self.command("pgrep", "-f", f"freeflex campaign run {self.folder}/c.yaml").stdout.split()
            if tasks:
                os.kill(int(self.random.choice(tasks)), signal.SIGKILL)
                killed += 1
        for task in (18, 19):
            self.command("scontrol", "requeue", f"{job}_{task}")
        self.end_of(job)
        self.assertIn("missing", self.campaign("status", "array").stdout)
        self.assertEqual(self.campaign("merge", "array").returncode, 3)
        self.end_of(self.submit())
        merged = self.campaign("merge", "array")
        self.assertEqual(merged.returncode, 0, merged.stderr + self.logs())
        self.assertEqual(self.table_of("array"), self.table)
        status = self.campaign("status", "array").stdout
        self.assertIn("complete", status)
        self.assertIn("Slurm: 2 jobs, all tasks have ended", status)


if __name__ == "__main__":
    unittest.main()
