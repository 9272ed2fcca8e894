#!/bin/sh
# Renders in turns: persons, rooms, then a few of the unseen split. One process at a time, at the lowest priority.
# Stop it at any time; the next start goes on behind the last finished file.
#   lab/training/render_all.sh WORK PYTHON [ROUNDS]
set -u
work=$1 python=$2 rounds=${3:-60}
make="nice -n 19 $python $(dirname "$0")/make.py"
mkdir -p "$work/log"
[ -d "$work/textures" ] || $make textures --work "$work"
$make portraits --work "$work" --count 16
round=1
while [ "$round" -le "$rounds" ]; do
    $make persons --work "$work" --count $((round * 10))
    $make rooms --work "$work" --count $((round * 2))
    if [ $((round % 4)) -eq 0 ]; then
        $make persons --work "$work" --split unseen --first-seed 2000000 --count $((round * 2))
        $make rooms --work "$work" --split unseen --first-seed 2000000 --count $((round / 2))
    fi
    round=$((round + 1))
done
