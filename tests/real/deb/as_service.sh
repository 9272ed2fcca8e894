#!/bin/sh
# as_service.sh ROOT STATE COMMAND...: runs a command like the hardened unit does, in separate mounts: ROOT is
# read-only except for its folder STATE, the user is one of systemd's dynamic users, and no privileges can be gained.
set -eu
root=$1
state=$2
shift 2
/bin/mount --bind "$root" "$root"
/bin/mount --bind /proc "$root/proc"
/bin/mount -o remount,bind,ro "$root"
/bin/mount --bind "$state" "$root/var/lib/lookdown"
exec /usr/bin/setpriv --no-new-privs /usr/sbin/chroot --userspec=61184:61184 --groups= "$root" "$@"
