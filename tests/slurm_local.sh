#!/usr/bin/env bash
# A throw-away SLURM on loopback for tests/runs/test_slurm.py: two nodes that claim four CPUs each, in a partition `main`; n1 alone is `kept`.
#   slurm_local.sh install                                     Debian's packages, where they are missing (root or sudo)
#   slurm_local.sh start DIR PORT | stop DIR                   PORT and the two after it have to be free
#   slurm_local.sh kill-node DIR n2 | start-node DIR n2        what a power cut looks like to the controller, and its end
# Nothing outside DIR is touched, apart from what `install` gets, and only processes that were started here are ended.
set -euo pipefail
PATH=$PATH:/usr/sbin:/sbin  # Debian leaves the daemons' folder out of a user's PATH
do=$1
if [ "$do" = install ]; then
  command -v slurmctld slurmd sbatch munged >/dev/null && exit 0
  sudo=; [ "$(id -u)" = 0 ] || sudo=sudo
  $sudo apt-get -qq update
  DEBIAN_FRONTEND=noninteractive exec $sudo apt-get install -qq -y --no-install-recommends slurmctld slurmd slurm-client munge
fi
dir=$2 port=${3:-}
export SLURM_CONF=$dir/slurm.conf

write_conf() {
  local host; host=$(hostname -s)
  cat >"$SLURM_CONF" <<C
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
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
SchedulerParameters=sched_interval=2,sched_min_interval=0,bf_interval=5,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
DefMemPerCPU=200
AccountingStorageType=accounting_storage/none
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=4 RealMemory=4000 State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=4 RealMemory=4000 State=UNKNOWN
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP LLN=YES
PartitionName=kept Nodes=n1 MaxTime=INFINITE State=UP
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
    [ "$(timeout 5 sinfo -h -N -p main -o %T 2>/dev/null | grep -c idle)" = 2 ] && exit 0
    sleep 0.2
  done
  echo "the nodes did not come up:" >&2
  tail -n 5 "$dir"/*.log >&2
  exit 1
}

# kill -9 of a node's daemon and of all that it started: its step daemons have its log open, the jobs have its environment.
kill_node() {
  local node=$1 p
  kill -9 "$(cat "$dir/$node.pid")"
  for p in /proc/[0-9]*; do
    if [ "$(cat "$p/comm" 2>/dev/null)" = slurmstepd ] && readlink "$p"/fd/* 2>/dev/null | grep -qx "$dir/$node.log"; then
      kill -9 "${p#/proc/}" 2>/dev/null || true
    fi
  done
  for p in /proc/[0-9]*; do
    if grep -qzx "SLURMD_NODENAME=$node" "$p/environ" 2>/dev/null && grep -qzx "SLURM_CONF=$SLURM_CONF" "$p/environ" 2>/dev/null; then
      kill -9 "${p#/proc/}" 2>/dev/null || true
    fi
  done
}

case $do in
  start) start;;
  kill-node) kill_node "$3";;
  start-node) rm -f "$dir/$3.pid"; slurmd -N "$3" -f "$SLURM_CONF" </dev/null >/dev/null 2>&1;;
  stop)
    timeout 10 scancel --quiet -u "$(id -un)" 2>/dev/null || true
    for _ in $(seq 50); do [ -z "$(timeout 5 squeue -h 2>/dev/null)" ] && break; sleep 0.2; done
    for p in n1 n2 slurmctld munge; do kill "$(cat "$dir/$p.pid")" 2>/dev/null || true; done
    for _ in $(seq 50); do ls "$dir"/*.pid >/dev/null 2>&1 || break; sleep 0.2; done;;  # each takes its own file away
  *) exit 2;;
esac
