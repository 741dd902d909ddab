#!/usr/bin/env bash
# A throw-away SLURM on loopback for tests/test_cluster.py: slurm_local.sh install | start DIR | kill-node DIR n2 | stop DIR
# Two nodes of two CPUs; nothing outside DIR is touched, apart from what `install` gets from Debian.
set -euo pipefail
do=$1
if [ "$do" = install ]; then
  command -v slurmctld slurmd sbatch munged >/dev/null && exit 0
  sudo=; [ "$(id -u)" = 0 ] || sudo=sudo
  $sudo apt-get -qq update
  DEBIAN_FRONTEND=noninteractive exec $sudo apt-get install -qq -y --no-install-recommends slurmctld slurmd slurm-client munge
fi
dir=$2
export SLURM_CONF=$dir/slurm.conf

write_conf() {
  local host; host=$(hostname -s)
  cat >"$SLURM_CONF" <<C
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=17100
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$dir/munge/sock,cred_expire=5
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool.%n
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/%n.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=2
JobAcctGatherParams=OverMemoryKill
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
KillWait=2
InactiveLimit=0
SchedulerParameters=sched_interval=2,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
DefMemPerCPU=200
AccountingStorageType=accounting_storage/none
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=17111 CPUs=2 RealMemory=4000 State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=17112 CPUs=2 RealMemory=4000 State=UNKNOWN
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
C
}

start() {
  mkdir -p "$dir/munge" "$dir/state" "$dir/spool.n1" "$dir/spool.n2"
  chmod 755 "$dir" "$dir/munge"
  write_conf
  (umask 077; head -c 1024 /dev/urandom >"$dir/munge/key")
  munged --key-file="$dir/munge/key" --socket="$dir/munge/sock" --pid-file="$dir/munge.pid" --log-file="$dir/munge/log" \
    --seed-file="$dir/munge/seed" --num-threads=2 --force </dev/null >/dev/null 2>&1
  slurmctld -f "$SLURM_CONF" </dev/null >/dev/null 2>&1
  for n in n1 n2; do slurmd -N $n -f "$SLURM_CONF" </dev/null >/dev/null 2>&1; done
  for _ in $(seq 100); do
    [ "$(timeout 5 sinfo -h -N -o %T 2>/dev/null | grep -c idle)" = 2 ] && exit 0
    sleep 0.2
  done
  echo "the nodes did not come up: see $dir/*.log" >&2
  exit 1
}

case $do in
  start) start;;
  stop)
    timeout 10 scancel --quiet -u "$(id -un)" 2>/dev/null || true
    for _ in $(seq 50); do [ -z "$(timeout 5 squeue -h 2>/dev/null)" ] && break; sleep 0.2; done
    for p in n1 n2 slurmctld munge; do kill "$(cat "$dir/$p.pid")" 2>/dev/null || true; done;;
  *) exit 2;;
esac
