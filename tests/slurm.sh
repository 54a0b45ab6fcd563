#!/usr/bin/env bash
# Runs a study in three parts as a job array of Slurm, of which one fails and is run again, and puts the parts together.
# Starts a Slurm of one node for it, in a folder of its own (Debian: slurm-wlm). Only root may do so.
# usage: tests/slurm.sh PROGRAM, which is the example error_vs_runtime
set -euo pipefail
program=$(realpath "$1")
part=$(realpath "$(dirname "$0")/dies_once.sh")
for needed in slurmctld slurmd sbatch munged; do
    if ! PATH=$PATH:/usr/sbin command -v "$needed" > /dev/null || [[ $(id -u) != 0 ]]; then
        echo "Slurm is not installed, or this is not root"
        exit 77
    fi
done
PATH=$PATH:/usr/sbin
folder=$(mktemp -d)
chmod 755 "$folder"
export SLURM_CONF=$folder/slurm.conf

stop() {
    for each in slurmd slurmctld munged; do
        [[ -e $folder/$each.pid ]] && kill "$(< "$folder/$each.pid")"
    done
    # The daemons write files until they have ended.
    sleep 1
    rm -rf "$folder"
} 2> /dev/null
trap stop EXIT

mkdir -p "$folder/state" "$folder/spool"
head -c 1024 /dev/urandom > "$folder/key"
chmod 400 "$folder/key"
host=$(hostname -s)
cat > "$SLURM_CONF" << END
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthInfo=socket=$folder/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
SlurmctldPort=6917
SlurmdPort=6918
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MailProg=/bin/true
NodeName=$host NodeAddr=127.0.0.1 CPUs=2
PartitionName=all Nodes=$host Default=YES
END
# No cgroups: they take rights that containers do not give.
printf 'CgroupAutomount=no\nIgnoreSystemd=yes\n' > "$folder/cgroup.conf"
munged --force --key-file "$folder/key" --socket "$folder/munge" --pid-file "$folder/munged.pid" \
    --log-file "$folder/munged.log" --seed-file "$folder/seed"
slurmctld
slurmd
for _ in {1..30}; do
    [[ $(sinfo --noheader --format %T) == idle ]] && break
    sleep 1
done
[[ $(sinfo --noheader --format %T) == idle ]] || { cat "$folder"/*.log; exit 1; }

study=("$program" --quick --scene spring --methods KickDriftKick --precision f32 --out "$folder/out")
array() {
    timeout 300 sbatch --quiet --wait --array=1-3 --output="$folder/part-%a.log" --wrap \
        "$part \$SLURM_ARRAY_TASK_ID $folder ${study[*]@Q} --shard \$SLURM_ARRAY_TASK_ID/3"
}
# The array fails because a part of it failed; the same command again runs the missing part.
code=0
array || code=$?
[[ $code != 0 && -e $folder/died ]]
array || { cat "$folder"/*.log; exit 1; }
"${study[@]}" --merge > /dev/null
grep -q '^spring,KickDriftKick,32,' "$folder/out/report.csv"
echo "an array of three parts, one of them made again, is one study"
