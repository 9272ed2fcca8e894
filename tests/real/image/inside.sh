#!/bin/sh
# inside.sh ROOT COMMAND...: runs a command as an engine told `--read-only --cap-drop ALL` would, in mounts of its
# own: ROOT cannot be written, the user is the image's, and nothing can be gained. Other programs are named in full,
# as PATH is the image's.
set -eu
root=$1
shift
/bin/mount --bind "$root" "$root"
/bin/mount --bind /dev "$root/dev"
/bin/mount --bind /proc "$root/proc"
/bin/mount -o remount,bind,ro "$root"
# Another user than root has no capabilities.
exec /usr/bin/setpriv --no-new-privs /usr/sbin/chroot --userspec=65532:65532 --groups= "$root" "$@"
