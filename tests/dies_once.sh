#!/usr/bin/env bash
# Runs a program for one part of a study. The first run of part 2 fails, and leaves FOLDER/died.
# usage: tests/dies_once.sh PART FOLDER PROGRAM [ARGUMENT]...
set -e
if [[ $1 == 2 && ! -e $2/died ]]; then
    touch "$2/died"
    exit 1
fi
shift 2
exec "$@"
