#!/bin/sh
# Renders in turns until enough exists: a few rooms, then persons, then the unseen split. One process, lowest priority.
# Stop it at any time; the next start goes on behind the last finished file.
#   training/render_all.sh WORK PYTHON [ROUNDS]
set -u
work=$1 python=$2 rounds=${3:-40}
make="nice -n 19 $python $(dirname "$0")/make.py"
mkdir -p "$work/log"
[ -d "$work/textures" ] || $make textures --work "$work"
$make portraits --work "$work" --count 16
round=1
while [ "$round" -le "$rounds" ]; do
    $make rooms --work "$work" --count $((round * 5))
    $make persons --work "$work" --count $((round * 25))
    $make rooms --work "$work" --split unseen --first-seed 2000000 --count "$round"
    $make persons --work "$work" --split unseen --first-seed 2000000 --count $((round * 4))
    round=$((round + 1))
done
