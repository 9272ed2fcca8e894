#!/bin/sh
# Prints the report of a frame as JSON: detect.sh FRAME [SERVER [PARAMETERS]].
set -eu
server=${2:-http://localhost:8080}
curl --silent --show-error --fail-with-body --form "img=@$1" "$server/detect?${3:-profile=balanced}"
