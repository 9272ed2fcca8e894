#!/bin/sh
# Prints the counts of a camera since midnight as CSV for a spreadsheet: counts_to_csv.sh CAMERA [SERVER [TIME_ZONE]].
set -eu
server=${2:-http://localhost:8080}
curl --silent --show-error --fail-with-body --get --data-urlencode "time_zone=${3:-UTC}" \
    --data "from=today&step=15m&format=csv" "$server/counts/$1"
