#!/bin/sh
# inside.sh ROOT COMMAND...: runs a command like an engine with `--read-only --cap-drop ALL`, in
# separate mounts: ROOT is read-only, the user is the image's, and no privileges can be gained. If
# VOLUME is set, that folder is /var/lib/lookdown.
# Other programs are called by their full path, as PATH is the image's.
set -eu
root=$1
shift
/bin/mount --bind "$root" "$root"
/bin/mount --bind /dev "$root/dev"
/bin/mount --bind /proc "$root/proc"
/bin/mount -o remount,bind,ro "$root"
if [ -n "${VOLUME:-}" ]; then
    /bin/mount --bind "$VOLUME" "$root/var/lib/lookdown"
    /bin/mount -t tmpfs tmpfs "$root/tmp"
fi
unset VOLUME
# Users other than root have no capabilities.
exec /usr/bin/setpriv --no-new-privs /usr/sbin/chroot --userspec=65532:65532 --groups= "$root" "$@"
