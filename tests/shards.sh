#!/usr/bin/env bash
# Runs a study in three parts by GNU parallel, of which one fails and is run again, and puts the parts together.
# usage: tests/shards.sh PROGRAM, which is the example error_vs_runtime
set -euo pipefail
program=$(realpath "$1")
part=$(realpath "$(dirname "$0")/dies_once.sh")
if ! command -v parallel > /dev/null; then
    echo "GNU parallel is not installed"
    exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
study=("$program" --quick --scene spring --methods KickDriftKick --precision f32 --out "$folder/out")

# In a folder without parts, --merge ends with exit code 3.
code=0
"${study[@]}" --merge 2> /dev/null || code=$?
[[ $code == 3 ]]
parallel --will-cite --jobs 2 --retries 2 --joblog "$folder/log" \
    "$part" {} "$folder" "${study[@]@Q}" --shard {}/3 ::: 1 2 3
[[ -e $folder/died ]]
# A part that exists is not run again.
before=$(ls -l --time-style=full-iso "$folder/out/runs")
"${study[@]}" --shard 2/3
[[ $before == "$(ls -l --time-style=full-iso "$folder/out/runs")" ]]
"${study[@]}" --merge > /dev/null
grep -q '^spring,KickDriftKick,32,' "$folder/out/report.csv"
echo "three parts, one of them made again, are one study"
