#!/bin/sh
# yade-batch's --executable: runs one table line with what yade-batch itself lacks, a lock and time limits.
# Called in the case's result folder with YADE_BATCH=<table>:<line>, CALIBRATOR_CPU_LIMIT in seconds of CPU time,
# which a busy machine does not use up, and CALIBRATOR_TIME_LIMIT, in seconds by the clock, for runs that hang.
# CALIBRATOR_YADE is the yade to call, where it is not the one on the PATH.
table=${YADE_BATCH%:*}
line=${YADE_BATCH##*:}
request=$(sed -n "1p;${line}p" "$table")
run_id=$(printf '%s\n' "$request" | sed -n '2s/^\([0-9a-f]*\) .*/\1/p')
[ -n "$run_id" ] || { echo "no run id in line $line of $table" >&2; exit 2; }
mkdir -p locks
for path in locks "locks/$run_id" checkpoints "checkpoints/$run_id"; do # what is written there would end elsewhere
  [ ! -L "$path" ] || { echo "$path is a symbolic link: remove it" >&2; exit 2; }
done
# A run that outlived its driver still holds this lock: wait for it, then find its record. YADE inherits the lock.
exec 9>"locks/$run_id"
flock -w "$CALIBRATOR_TIME_LIMIT" 9 || exit 124
[ -e "records/$run_id.json" ] && exit 0
# YADE reads the table again, which may have been edited meanwhile: it gets the line that the lock was taken for.
rm -f "locks/$run_id.table"
printf '%s\n' "$request" > "locks/$run_id.table" || exit 2
export YADE_BATCH="locks/$run_id.table:2"
# YADE inherits the limit and dies of signal 24 (status 152); a core dump of it would help nobody.
ulimit -S -c 0
[ -z "$CALIBRATOR_CPU_LIMIT" ] || ulimit -S -t "$CALIBRATOR_CPU_LIMIT" || exit 2
exec timeout --foreground --kill-after=10 "$CALIBRATOR_TIME_LIMIT" "${CALIBRATOR_YADE:-yade}" -n "$@"
