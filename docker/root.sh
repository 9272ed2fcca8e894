#!/bin/sh
# root.sh FOLDER PACKAGE... [-- PROGRAM...]: makes FOLDER a root file system with the run-time files of these
# installed Debian packages, and these installed programs with the libraries that they load.
set -eu
root=$1
shift
mkdir -p "$root/usr/bin" "$root/usr/lib" "$root/usr/lib64" "$root/etc/ssl/certs" "$root/var/lib/dpkg/status.d" \
    "$root/var/lib/lookdown" "$root/tmp" "$root/opt/lookdown/calibrations"
ln -s usr/bin usr/lib usr/lib64 "$root"

# Copies what a package says about itself: its license, and its entry for vulnerability scanners.
describe() {
    install -D --mode=644 "/usr/share/doc/$1/copyright" "$root/usr/share/doc/$1/copyright"
    dpkg-query --status "$1" > "$root/var/lib/dpkg/status.d/$1"
}

# Copies a file, and notes the paths under which its package may list it.
copied=
copy_file() {
    file=$(realpath --no-symlinks "$1")
    real=$(realpath "$file")
    # `/lib` is a link to a folder below `/usr`.
    case $file in /lib/* | /lib64/*) file=/usr$file ;; esac
    mkdir -p "$root$(dirname "$file")"
    # Some libraries are links by way of /etc/alternatives: the copy is the library itself.
    cp --dereference --preserve=mode,timestamps "$real" "$root$file"
    copied="$copied $real ${real#/usr}"
}

while [ $# -gt 0 ] && [ "$1" != -- ]; do
    # Copies libraries without the character set converters.
    dpkg-query --listfiles "$1" | grep -v /gconv/ | while read -r file; do
        case $file in
            # These folders are links to folders below /usr; package lists use the old paths.
            /lib/* | /lib64/*) file=/usr$file ;;
            /usr/lib/*) ;;
            *) continue ;;
        esac
        if [ -f "$file" ]; then cp --archive --parents "$file" "$root"; fi
    done
    describe "$1"
    shift
done
if [ $# -gt 0 ]; then shift; fi
for program in "$@"; do
    copy_file "$program"
    for library in $(ldd "$program" | sed -n 's/^.* => \(\/[^ ]*\) .*$/\1/p'); do copy_file "$library"; done
done
if [ -n "$copied" ]; then
    # shellcheck disable=SC2086
    for package in $(dpkg-query --search $copied 2> /dev/null | sed 's/[:,].*//' | sort -u); do describe "$package"; done
fi
cp --dereference /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
cp /etc/debian_version /etc/os-release "$root/etc/"
chmod 1777 "$root/tmp"
echo 'lookdown:x:65532:65532:Lookdown:/opt/lookdown:/nonexistent' > "$root/etc/passwd"
echo 'lookdown:x:65532:' > "$root/etc/group"
echo 'hosts: files dns' > "$root/etc/nsswitch.conf"
# Makes volumes that are mounted here writable by the program.
chown 65532:65532 "$root/opt/lookdown/calibrations" "$root/var/lib/lookdown"
chmod 700 "$root/var/lib/lookdown"
