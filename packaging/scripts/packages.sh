#!/bin/sh
# packages.sh PACKAGE...: installs the Debian packages that are missing. Prints their names if the user is not root.
set -eu
missing=
for package in "$@"; do
    dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing="$missing $package"
done
[ -n "$missing" ] || exit 0
if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
    echo "packages   missing, and only root on Debian can install them:$missing" >&2
    exit 0
fi
echo "packages   installing$missing"
export DEBIAN_FRONTEND=noninteractive
apt-get update -q
# shellcheck disable=SC2086 # several words
apt-get install -q -y --no-install-recommends $missing
