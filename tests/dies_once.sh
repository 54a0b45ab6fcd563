#!/usr/bin/env bash
# Runs a program for one part of a study; the second part dies the first time, and leaves FOLDER/died.
# usage: tests/dies_once.sh PART FOLDER PROGRAM [ARGUMENT]...
set -e
if [[ $1 == 2 && ! -e $2/died ]]; then
    touch "$2/died"
    exit 1
fi
shift 2
exec "$@"
